//! Where a scene says what it asks of a material, so that diagnostics show the scene's line.

use std::ops::Range;
use std::sync::Arc;

use crate::diag::Diagnostic;
use crate::source::{FileId, SourceMap, Span};

/// The text of a scene file, and the places in it of one binding. All ranges are of bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The scene file, as diagnostics call it.
    pub path: String,
    /// Its text.
    pub text: Arc<str>,
    /// Where it names the material's file, if it does: on a built-in set the command does.
    pub file: Option<Range<usize>>,
    /// Where it names the material of the file, if it does.
    pub material: Option<Range<usize>>,
    /// Its parameters.
    pub params: Vec<WrittenParam>,
}

/// Where a scene sets a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenParam {
    /// The parameter's name.
    pub name: String,
    /// Where the name is.
    pub key: Range<usize>,
    /// Where the value is.
    pub value: Range<usize>,
}

impl Written {
    /// Where a parameter is set.
    pub fn param(&self, name: &str) -> Option<&WrittenParam> {
        self.params.iter().find(|p| p.name == name)
    }

    /// Puts a part of the scene under those of `diagnostics` that have no place.
    pub(crate) fn place(
        &self,
        part: &Range<usize>,
        sources: &mut SourceMap,
        diagnostics: &mut [Diagnostic],
    ) {
        for diagnostic in diagnostics.iter_mut().filter(|d| d.span.is_none()) {
            diagnostic.span = Some(Span::new(self.source(sources), part.clone()));
        }
    }

    /// Takes `diagnostics` about `snippet`, the value of a parameter, to where the scene says it.
    pub(crate) fn take_over(
        &self,
        param: &WrittenParam,
        snippet: FileId,
        sources: &mut SourceMap,
        diagnostics: &mut [Diagnostic],
    ) {
        let value = param.value.clone();
        // Escapes are the one way in which a text is not what the scene says.
        let within = self.text[value.clone()].find(&*sources.file(snippet).text);
        for diagnostic in diagnostics {
            if within.is_none() {
                // What would be changed is not what the scene says.
                diagnostic.fixes.retain(|fix| fix.span.file != snippet);
            }
            let labels = diagnostic.labels.iter_mut().map(|l| &mut l.span);
            let fixes = diagnostic.fixes.iter_mut().map(|f| &mut f.span);
            for span in labels.chain(fixes).chain(&mut diagnostic.span) {
                if span.file != snippet {
                    continue;
                }
                let place = match within {
                    Some(offset) => {
                        let start = value.start + offset;
                        start + span.start as usize..start + span.end as usize
                    }
                    None => value.clone(),
                };
                *span = Span::new(self.source(sources), place);
            }
        }
    }

    /// The scene among the sources.
    fn source(&self, sources: &mut SourceMap) -> FileId {
        let known = sources.files().find(|(_, file)| file.name == self.path);
        let known = known.map(|(id, _)| id);
        known.unwrap_or_else(|| sources.add(self.path.as_str(), &*self.text))
    }
}
