//! What tests found as the XML that JUnit writes, which services for CI read.

use std::fmt::Write;

use impasto::compiler::diag;
use impasto::verify::check::File;

use super::Tested;

/// A suite for each file, with a case for each material and bsdf.
pub(super) fn text(files: &[&File], tested: &[Tested<'_>]) -> String {
    let mut suites = String::new();
    let mut failures = 0;
    for file in files {
        let cases: Vec<&Tested<'_>> = tested.iter().filter(|t| t.file.path == file.path).collect();
        let broken = diag::has_errors(&file.diagnostics);
        let failed = cases.iter().filter(|t| !t.passed()).count();
        failures += failed + usize::from(broken);
        let seconds: f64 = cases.iter().map(|t| t.took.as_secs_f64()).sum();
        // Writing to a string cannot fail.
        let _ = writeln!(
            suites,
            "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{failed}\" errors=\"{}\" time=\"{seconds:.3}\">",
            escaped(&file.path),
            cases.len() + usize::from(broken),
            usize::from(broken),
        );
        if broken {
            let why = diag::render::text(&file.sources, &file.diagnostics, false);
            let _ = writeln!(
                suites,
                "    <testcase name=\"compile\" classname=\"{}\"><error message=\"does not compile\">{}</error></testcase>",
                escaped(&file.path),
                escaped(&why),
            );
        }
        cases.iter().for_each(|t| case(t, &mut suites));
        suites += "  </testsuite>\n";
    }
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"impasto test\" tests=\"{}\" failures=\"{failures}\">\n\
         {suites}</testsuites>\n",
        tested.len()
    )
}

fn case(t: &Tested<'_>, out: &mut String) {
    let (name, path) = (escaped(&t.subject.name), escaped(&t.file.path));
    let seconds = t.took.as_secs_f64();
    let _ = write!(
        out,
        "    <testcase name=\"{name}\" classname=\"{path}\" time=\"{seconds:.3}\""
    );
    if t.passed() {
        *out += "/>\n";
        return;
    }
    *out += ">\n";
    let verdict = t.verdict.diagnostics.iter().map(|d| (&t.file.sources, d));
    let kept = t.kept.diagnostics.iter().map(|d| (t.kept_sources(), d));
    for (sources, found) in verdict.chain(kept) {
        let text = diag::render::text(sources, std::slice::from_ref(found), false);
        let _ = writeln!(
            out,
            "      <failure type=\"{}\" message=\"{}\">{}</failure>",
            found.code.id(),
            escaped(&found.message),
            escaped(&text),
        );
    }
    *out += "    </testcase>\n";
}

/// A text within XML; what XML cannot say is left out.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\n' => out.push('\n'),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => {}
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::escaped;

    #[test]
    fn what_xml_cannot_say_is_left_out() {
        assert_eq!(
            escaped("a<b>&\"c\"\u{1b}[0m\n"),
            "a&lt;b&gt;&amp;&quot;c&quot;[0m\n"
        );
    }
}
