//! What older versions of MaterialX call otherwise, from 1.36 on.

use crate::error::ImportError;
use crate::mtlx::document::{Document, Id, ROOT};

/// The oldest version whose documents are read: minor numbers of version 1.
const OLDEST: u32 = 36;
/// The newest.
const NEWEST: u32 = 39;

/// Refuses documents of other versions.
pub(crate) fn check_version(document: &Document) -> Result<(), ImportError> {
    let version = document.attribute(ROOT, "version").unwrap_or_default();
    let minor = version.strip_prefix("1.").map(|minor| {
        let digits = minor.split(|c: char| !c.is_ascii_digit()).next();
        digits.unwrap_or_default().parse::<u32>()
    });
    match minor {
        Some(Ok(minor)) if (OLDEST..=NEWEST).contains(&minor) => Ok(()),
        _ => {
            let message = match version {
                "" => "the document does not say its version".to_owned(),
                version => format!("the document has the version {version} of MaterialX"),
            };
            let error = document.error(ROOT, message);
            let error = error.expected(format!("a version from 1.{OLDEST} to 1.{NEWEST}"));
            Err(error.hint("MaterialX's own tools upgrade old documents"))
        }
    }
}

/// The category of a node today.
pub(crate) fn category(document: &Document, node: Id) -> String {
    let category = document.category(node);
    let ty = document.attribute(node, "type").unwrap_or_default();
    let has = |name: &str| document.input(node, name).is_some();
    let counted = |of: &str| {
        let digit = of.chars().next_back().filter(char::is_ascii_digit);
        digit.map_or(category.to_owned(), |digit| format!("{category}{digit}"))
    };
    match category {
        "invert" if ty.starts_with("matrix") => "invertmatrix".into(),
        "rotate" => (if ty == "vector2" {
            "rotate2d"
        } else {
            "rotate3d"
        })
        .into(),
        "combine" => counted(ty),
        "separate" => {
            let input = document.input(node, "in");
            counted(
                input
                    .and_then(|input| document.attribute(input, "type"))
                    .unwrap_or_default(),
            )
        }
        "transformpoint" | "transformvector" | "transformnormal" if has("mat") => {
            "transformmatrix".into()
        }
        category => category.to_owned(),
    }
}
