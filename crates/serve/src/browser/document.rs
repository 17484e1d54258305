//! The page as one document: its style and its modules stand in it, nothing is fetched.
//!
//! Modules import each other by bare names. An import map leads each name to the module's text as a `data:` address, so that the
//! document also works from a file.

use std::fmt::Write as _;
use std::sync::LazyLock;

/// The modules, by the names that they import each other by.
const MODULES: [(&str, &str); 14] = [
    ("camera", include_str!("../../page/camera.js")),
    ("chart", include_str!("../../page/chart.js")),
    ("colours", include_str!("../../page/colours.js")),
    ("dom", include_str!("../../page/dom.js")),
    ("job", include_str!("../../page/job.js")),
    ("jog", include_str!("../../page/jog.js")),
    ("link", include_str!("../../page/link.js")),
    ("main", include_str!("../../page/main.js")),
    ("panels", include_str!("../../page/panels.js")),
    ("program", include_str!("../../page/program.js")),
    ("scene", include_str!("../../page/scene.js")),
    ("sender", include_str!("../../page/sender.js")),
    ("state", include_str!("../../page/state.js")),
    ("strokes", include_str!("../../page/strokes.js")),
];
const VIEW: (&str, &str) = ("view", include_str!("../../page/view.js"));
const PAGE: &str = include_str!("../../page/page.html");
const STYLE: &str = include_str!("../../page/style.css");

/// The place of the answer's own secret, by which the browser knows our scripts.
const NONCE: &str = "NONCE";

static DOCUMENT: LazyLock<String> = LazyLock::new(compose);

/// The document; scripts in it run where the answer allows those with this `nonce`.
pub(crate) fn document(nonce: &str) -> String {
    DOCUMENT.replace(NONCE, nonce)
}

fn compose() -> String {
    let mut map = String::new();
    for (name, text) in MODULES.iter().chain([&VIEW]) {
        let comma = if map.is_empty() { "" } else { "," };
        // Writing to a text cannot fail.
        let _ = write!(
            map,
            "{comma}\n\"{name}\": \"data:text/javascript,{}\"",
            quoted(text)
        );
    }
    let modules = format!(
        "<script type=\"importmap\" nonce=\"{NONCE}\">{{\"imports\": {{{map}\n}}}}</script>\n\
        <script type=\"module\" nonce=\"{NONCE}\">import \"main\";</script>"
    );
    PAGE.replace("<!--style-->", &format!("<style>\n{STYLE}</style>"))
        .replace("<!--modules-->", &modules)
}

/// A text as part of a `data:` address within a JSON string within a script element (RFC 3986, section 2.1).
fn quoted(text: &str) -> String {
    let mut quoted = String::with_capacity(text.len() * 5 / 4);
    for byte in text.bytes() {
        match byte {
            b'%' | b'"' | b'\\' | b'#' | b'<' | b'\n' | b'\r' | b'\t' | 0x80.. => {
                let _ = write!(quoted, "%{byte:02X}");
            }
            printed => quoted.push(printed.into()),
        }
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest size of a page, bytes.
    const MOST: usize = 200_000;

    #[test]
    fn the_document_is_whole_and_light() {
        let document = document("secret");
        assert!(document.len() <= MOST, "{} bytes", document.len());
        assert!(!document.contains("<!--style-->") && !document.contains("<!--modules-->"));
        assert_eq!(document.matches("nonce=\"secret\"").count(), 2);
        assert_eq!(document.matches("</script>").count(), 2);
    }

    #[test]
    fn nothing_is_fetched() {
        let document = document("");
        for address in ["src=\"http", "href=\"http", "url(", "@import", "fetch("] {
            assert!(!document.contains(address), "{address}");
        }
    }

    #[test]
    fn every_module_that_is_imported_is_there() {
        let all: Vec<&str> = MODULES
            .iter()
            .chain([&VIEW])
            .map(|(name, _)| *name)
            .collect();
        for (name, text) in MODULES.iter().chain([&VIEW]) {
            let imports = text.lines().filter_map(|line| line.strip_prefix("import "));
            for import in imports {
                let from = import.split('"').nth(1).unwrap();
                assert!(all.contains(&from), "{name} imports {from}");
            }
        }
    }
}
