// What regular expressions cannot tell, since they do not look ahead. It does what the compiler's lexer does
// (compiler/src/lexer/token.rs): numbers, units behind them, and documentation comments. It keeps no state.

#include "tree_sitter/parser.h"

enum Token { INTEGER, FLOAT, UNIT, DOC_MARKER, FILE_DOC_MARKER, DOC_TEXT, UNTERMINATED, RECOVERING };

static const char *const UNITS[] = {"nm", "um", "mm", "cm", "m", "km", "deg", "rad"};

// Longer than any unit.
enum { WORD = 8 };

void *tree_sitter_impasto_external_scanner_create(void) { return NULL; }

void tree_sitter_impasto_external_scanner_destroy(void *payload) { (void)payload; }

unsigned tree_sitter_impasto_external_scanner_serialize(void *payload, char *buffer) {
    (void)payload;
    (void)buffer;
    return 0;
}

void tree_sitter_impasto_external_scanner_deserialize(void *payload, const char *buffer, unsigned length) {
    (void)payload;
    (void)buffer;
    (void)length;
}

static bool is_digit(int32_t c) { return c >= '0' && c <= '9'; }

static bool is_letter(int32_t c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

static void advance(TSLexer *lexer) { lexer->advance(lexer, false); }

static bool take_digits(TSLexer *lexer) {
    bool any = false;
    while (is_digit(lexer->lookahead)) {
        advance(lexer);
        any = true;
    }
    return any;
}

// Takes `e-3` and ends the token behind it. Otherwise the token stays as long as it was.
static bool take_exponent(TSLexer *lexer) {
    if (lexer->lookahead != 'e' && lexer->lookahead != 'E') return false;
    advance(lexer);
    if (lexer->lookahead == '+' || lexer->lookahead == '-') advance(lexer);
    if (!take_digits(lexer)) return false;
    lexer->mark_end(lexer);
    return true;
}

static bool ends_as(TSLexer *lexer, enum Token token, const bool *valid) {
    lexer->result_symbol = token;
    return valid[token];
}

// `.5`, `.5e3`; the place is at the point.
static bool scan_fraction(TSLexer *lexer, const bool *valid) {
    advance(lexer);
    if (!take_digits(lexer)) return false;
    lexer->mark_end(lexer);
    take_exponent(lexer);
    return ends_as(lexer, FLOAT, valid);
}

// `12`, `12u`, `0xff`, `1.5`, `2.`, `1e-3`; but `0..8` and `2.x` start with an integer, and so does `12um`.
static bool scan_number(TSLexer *lexer, const bool *valid) {
    bool zero = lexer->lookahead == '0';
    advance(lexer);
    if (zero && lexer->lookahead == 'x') {
        advance(lexer);
        while (is_letter(lexer->lookahead) || is_digit(lexer->lookahead)) advance(lexer);
        lexer->mark_end(lexer);
        return ends_as(lexer, INTEGER, valid);
    }
    take_digits(lexer);
    lexer->mark_end(lexer);
    if (lexer->lookahead == '.') {
        advance(lexer);
        bool digits = take_digits(lexer);
        if (!digits && (lexer->lookahead == '.' || is_letter(lexer->lookahead))) {
            return ends_as(lexer, INTEGER, valid);
        }
        lexer->mark_end(lexer);
        take_exponent(lexer);
        return ends_as(lexer, FLOAT, valid);
    }
    if (lexer->lookahead == 'u') {
        advance(lexer);
        if (!is_letter(lexer->lookahead) && !is_digit(lexer->lookahead)) lexer->mark_end(lexer);
        return ends_as(lexer, INTEGER, valid);
    }
    return ends_as(lexer, take_exponent(lexer) ? FLOAT : INTEGER, valid);
}

// A name that is a unit.
static bool scan_unit(TSLexer *lexer) {
    char word[WORD];
    unsigned length = 0;
    while (is_letter(lexer->lookahead) || is_digit(lexer->lookahead)) {
        if (length + 1 >= WORD) return false;
        word[length++] = (char)lexer->lookahead;
        advance(lexer);
    }
    lexer->mark_end(lexer);
    for (unsigned unit = 0; unit < sizeof UNITS / sizeof *UNITS; unit++) {
        const char *name = UNITS[unit];
        unsigned i = 0;
        while (i < length && name[i] == word[i]) i++;
        if (i == length && name[i] == '\0') {
            lexer->result_symbol = UNIT;
            return true;
        }
    }
    return false;
}

// `///` or `//!`; `////` is a comment, as rulers of slashes are.
static bool scan_doc_marker(TSLexer *lexer, const bool *valid) {
    advance(lexer);
    if (lexer->lookahead != '/') return false;
    advance(lexer);
    if (lexer->lookahead == '!') {
        advance(lexer);
        lexer->mark_end(lexer);
        return ends_as(lexer, FILE_DOC_MARKER, valid);
    }
    if (lexer->lookahead != '/') return false;
    advance(lexer);
    lexer->mark_end(lexer);
    return lexer->lookahead != '/' && ends_as(lexer, DOC_MARKER, valid);
}

// The rest of a line of documentation, with its line break: lines put together are the text that was written.
static bool scan_doc_text(TSLexer *lexer) {
    if (lexer->eof(lexer)) return false;
    while (!lexer->eof(lexer) && lexer->lookahead != '\n') advance(lexer);
    if (!lexer->eof(lexer)) advance(lexer);
    lexer->mark_end(lexer);
    lexer->result_symbol = DOC_TEXT;
    return true;
}

// The end of a line in a string; takes nothing.
static bool scan_unterminated(TSLexer *lexer) {
    lexer->mark_end(lexer);
    lexer->result_symbol = UNTERMINATED;
    return lexer->eof(lexer) || lexer->lookahead == '\n' || lexer->lookahead == '\r';
}

bool tree_sitter_impasto_external_scanner_scan(void *payload, TSLexer *lexer, const bool *valid) {
    (void)payload;
    // While the parser recovers, every token counts as valid: a name `m` there is no unit.
    bool recovering = valid[RECOVERING];
    if (valid[DOC_TEXT] && !recovering) return scan_doc_text(lexer);
    if (valid[UNTERMINATED] && !recovering) return scan_unterminated(lexer);
    while (lexer->lookahead == ' ' || (lexer->lookahead >= '\t' && lexer->lookahead <= '\r' && lexer->lookahead != '\v')) {
        lexer->advance(lexer, true);
    }
    int32_t c = lexer->lookahead;
    if (c == '/') return (valid[DOC_MARKER] || valid[FILE_DOC_MARKER]) && scan_doc_marker(lexer, valid);
    if (is_digit(c)) return (valid[INTEGER] || valid[FLOAT]) && scan_number(lexer, valid);
    if (c == '.') return valid[FLOAT] && scan_fraction(lexer, valid);
    return valid[UNIT] && !recovering && is_letter(c) && scan_unit(lexer);
}
