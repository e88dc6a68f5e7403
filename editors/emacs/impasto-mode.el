;;; impasto-mode.el --- Materials in the Impasto language  -*- lexical-binding: t; -*-

;; SPDX-License-Identifier: MIT OR Apache-2.0
;; Version: 0.1.0
;; Package-Requires: ((emacs "27.1"))
;; Keywords: languages

;;; Commentary:

;; Colors, indentation and an index of definitions for sources of Impasto, and the language server of the command
;; `impasto' through Eglot.  A test of the crate tree-sitter-impasto holds the words below to the compiler's tables.
;;
;;   (require 'impasto-mode)
;;   (add-hook 'impasto-mode-hook #'eglot-ensure)

;;; Code:

(require 'rx)
(require 'subr-x)

(defgroup impasto nil
  "Materials in the Impasto language."
  :group 'languages
  :prefix "impasto-")

(defcustom impasto-command "impasto"
  "The command, as a name on the variable `exec-path' or a path."
  :type 'string)

(defcustom impasto-scene ""
  "The scene file whose plan is shown above materials; none if empty."
  :type 'string
  :safe #'stringp)

(defcustom impasto-indent-offset 4
  "Columns of a level of indentation."
  :type 'integer
  :safe #'integerp)

(defconst impasto-keywords
  '("material" "bsdf" "delta" "edf" "fn" "struct" "const" "private" "use" "as" "param" "let" "var" "if" "else"
    "for" "in" "while" "limit" "break" "continue" "assert" "when" "true" "false"))

(defconst impasto-types
  '("bool" "int" "uint" "float" "length" "angle" "vec2" "vec3" "vec4" "color" "point" "vector" "normal" "mat2"
    "mat3" "texture" "bsdf" "edf" "medium"))

(defconst impasto-surface
  '("position" "normal" "geometric_normal" "tangent" "uv" "exterior_ior" "view" "instance_id" "object_position"
    "object_scale" "uv1" "vertex_color" "facing" "object_normal" "time" "frame"
    "surface" "emission" "interior" "opacity"))

(defconst impasto-units
  '("nm" "um" "mm" "cm" "m" "km" "deg" "rad"))

(defvar impasto-mode-syntax-table
  (let ((table (make-syntax-table)))
    (modify-syntax-entry ?_ "_" table)
    (modify-syntax-entry ?/ ". 124b" table)
    (modify-syntax-entry ?* ". 23" table)
    (modify-syntax-entry ?\n "> b" table)
    (modify-syntax-entry ?\" "\"" table)
    ;; There are no escapes in strings.
    (modify-syntax-entry ?\\ "." table)
    (modify-syntax-entry ?' "." table)
    (dolist (mark '(?+ ?- ?% ?& ?| ?^ ?< ?> ?= ?! ?. ?, ?\; ?:))
      (modify-syntax-entry mark "." table))
    table)
  "What characters are in sources of Impasto.")

(defconst impasto--name "[A-Za-z_][A-Za-z0-9_]*")

(defconst impasto-font-lock-keywords
  `(;; Documentation: `Source:' and what tests are told.
    (,(rx "//" (any "/!") (* " ") (group upper (* lower) ":")) 1 font-lock-constant-face t)
    ;; Definitions.
    (,(concat "\\_<\\(?:material\\|struct\\)\\s-+\\(" impasto--name "\\)") 1 font-lock-type-face)
    (,(concat "\\_<\\(?:fn\\|bsdf\\|edf\\)\\s-+\\(" impasto--name "\\)\\s-*(") 1 font-lock-function-name-face)
    (,(concat "\\_<\\(?:param\\|let\\|var\\|const\\)\\s-+\\(" impasto--name "\\)") 1 font-lock-variable-name-face)
    ;; A type stands behind the colon of a declaration, or an arrow. In a signature any colon will do.
    (,(concat "\\_<\\(?:param\\|let\\|var\\|const\\)\\s-+" impasto--name "\\s-*:\\s-*\\(" impasto--name "\\)")
     1 font-lock-type-face)
    (,(concat "->\\s-*\\(" impasto--name "\\)") 1 font-lock-type-face)
    (,(concat "\\_<\\(?:fn\\|bsdf\\|edf\\)\\s-+" impasto--name "\\s-*(")
     (,(concat "\\_<" impasto--name "\\s-*:\\s-*\\(" impasto--name "\\)")
      (save-excursion (ignore-errors (backward-char) (forward-sexp)) (point))
      nil
      (1 font-lock-type-face)))
    ;; Modules.
    (,(concat "\\_<\\(" impasto--name "\\)\\s-*::") 1 font-lock-constant-face)
    (,(regexp-opt '("true" "false") 'symbols) . font-lock-constant-face)
    (,(regexp-opt impasto-keywords 'symbols) . font-lock-keyword-face)
    ;; Calls, and arguments by name.
    (,(concat "\\_<" impasto--name "\\_>\\s-*\\(?:(\\)") (0 nil))
    (,(concat "\\(\\_<" impasto--name "\\)\\s-*:[^:]") 1 font-lock-variable-name-face)
    (,(concat "\\." impasto--name) (0 nil))
    (,(regexp-opt impasto-surface 'symbols) . font-lock-builtin-face)
    ("\\_<_*[A-Z][A-Z0-9_]*\\_>" . font-lock-constant-face)
    ;; A number with its unit.
    (,(concat "\\_<[0-9]+\\(?:\\.[0-9]*\\)?\\(?:[eE][-+]?[0-9]+\\)?\\s-*\\(" (regexp-opt impasto-units) "\\)\\_>")
     1 font-lock-type-face))
  "What is colored in sources of Impasto.")

(defun impasto--documentation-face (state)
  "The face of the comment or string that the parse STATE is in."
  (cond
   ((nth 3 state) font-lock-string-face)
   ((save-excursion
      (goto-char (nth 8 state))
      (looking-at "//\\(?:!\\|/\\(?:[^/]\\|$\\)\\)"))
    font-lock-doc-face)
   (t font-lock-comment-face)))

;; Indentation: a level for a bracket that is open at the end of a line, and one for lines that go on.

(defun impasto--bare-line ()
  "The line at point without strings and comments."
  (let ((line (buffer-substring-no-properties (line-beginning-position) (line-end-position))))
    (setq line (replace-regexp-in-string "\"[^\"]*\"?" "" line))
    (setq line (replace-regexp-in-string "/\\*.*?\\*/" "" line))
    (string-trim-right (replace-regexp-in-string "//.*\\'" "" line))))

(defun impasto--previous-line ()
  "Go to the last line of code above; nil if there is none."
  (let (found)
    (while (and (not found) (zerop (forward-line -1)))
      (setq found (not (string-empty-p (impasto--bare-line)))))
    found))

(defun impasto--statement-column ()
  "The column where the statement starts that the line at point belongs to."
  (save-excursion
    (let ((column (current-indentation))
          (goes-on t))
      (while (and goes-on
                  (not (string-match-p "\\`\\s-*[])}]" (impasto--bare-line)))
                  (impasto--previous-line)
                  (not (string-match-p "[;,{}([]\\'" (impasto--bare-line))))
        (setq column (current-indentation)))
      column)))

(defun impasto--column ()
  "The column that the line at point should start at."
  (save-excursion
    (beginning-of-line)
    (let ((closes (looking-at-p "[ \t]*[])}]")))
      (if (not (impasto--previous-line))
          0
        (let ((bare (impasto--bare-line)))
          (cond
           ((string-match-p "[([{]\\'" bare)
            (+ (current-indentation) (if closes 0 impasto-indent-offset)))
           (closes (max 0 (- (impasto--statement-column) impasto-indent-offset)))
           ((string-match-p "[;,}]\\'" bare) (impasto--statement-column))
           (t (+ (impasto--statement-column) impasto-indent-offset))))))))

(defun impasto-indent-line ()
  "Indent the line at point."
  (let ((column (impasto--column)))
    (if (<= (current-column) (current-indentation))
        (indent-line-to column)
      (save-excursion (indent-line-to column)))))

;; Commands.

(defun impasto-preview ()
  "Open the preview of the file, which follows each save."
  (interactive)
  (save-buffer)
  (start-process "impasto-view" "*impasto view*" impasto-command "view" (buffer-file-name)))

(defun impasto--printed (name &rest arguments)
  "Show what the command prints with ARGUMENTS in the buffer NAME."
  (let ((buffer (get-buffer-create name)))
    (with-current-buffer buffer
      (let ((inhibit-read-only t))
        (erase-buffer)
        (apply #'call-process impasto-command nil t nil arguments)
        (goto-char (point-min))
        (special-mode)))
    (display-buffer buffer)))

(defun impasto-wgsl ()
  "Show the shader that the file becomes."
  (interactive)
  (save-buffer)
  (impasto--printed "*impasto wgsl*" "emit" (buffer-file-name) "--what" "wgsl"))

(defun impasto-cost ()
  "Show what the materials of the file cost."
  (interactive)
  (save-buffer)
  (impasto--printed "*impasto cost*" "cost" (buffer-file-name)))

(defvar impasto-mode-map
  (let ((map (make-sparse-keymap)))
    (define-key map (kbd "C-c C-p") #'impasto-preview)
    (define-key map (kbd "C-c C-w") #'impasto-wgsl)
    (define-key map (kbd "C-c C-k") #'impasto-cost)
    map)
  "Keys in sources of Impasto.")

(defvar eglot-workspace-configuration)

;;;###autoload
(define-derived-mode impasto-mode prog-mode "Impasto"
  "A mode for materials in the Impasto language."
  (setq-local comment-start "// ")
  (setq-local comment-end "")
  (setq-local comment-start-skip "\\(?://+!?\\|/\\*+\\)\\s-*")
  (setq-local indent-line-function #'impasto-indent-line)
  (setq-local indent-tabs-mode nil)
  (setq-local tab-width impasto-indent-offset)
  (setq-local electric-indent-chars (append "})]" electric-indent-chars))
  (setq-local font-lock-defaults
              '(impasto-font-lock-keywords
                nil nil nil nil
                (font-lock-syntactic-face-function . impasto--documentation-face)))
  (setq-local eglot-workspace-configuration #'impasto-workspace-configuration)
  (setq-local imenu-generic-expression
              `(("Material" ,(concat "^\\(?:private\\s-+\\)?material\\s-+\\(" impasto--name "\\)") 1)
                ("Closure" ,(concat "^\\(?:private\\s-+\\)?\\(?:delta\\s-+\\)?\\(?:bsdf\\|edf\\)\\s-+\\("
                                    impasto--name "\\)") 1)
                ("Function" ,(concat "^\\(?:private\\s-+\\)?fn\\s-+\\(" impasto--name "\\)") 1)
                ("Struct" ,(concat "^\\(?:private\\s-+\\)?struct\\s-+\\(" impasto--name "\\)") 1)
                ("Constant" ,(concat "^\\(?:private\\s-+\\)?const\\s-+\\(" impasto--name "\\)") 1))))

;;;###autoload
(add-to-list 'auto-mode-alist '("\\.impasto\\'" . impasto-mode))

;; The language server, by Eglot (part of Emacs from 29 on, and of GNU ELPA).

(defun impasto-server (&rest _)
  "The language server's command, for `eglot-server-programs'."
  (list impasto-command "lsp"))

(defun impasto-workspace-configuration (&rest _)
  "The settings of the server, for `eglot-workspace-configuration'."
  `(:impasto (:scene ,impasto-scene)))

(defvar eglot-server-programs)
(with-eval-after-load 'eglot
  (add-to-list 'eglot-server-programs '(impasto-mode . impasto-server)))

(provide 'impasto-mode)
;;; impasto-mode.el ends here
