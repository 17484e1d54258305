//! `cargo xtask api`: what the facade shows to its users, against the committed list.
//!
//! rustdoc resolves all that `leadscrew` re-exports. Its pages are read as text: a line for each
//! item, method, variant, and trait of a type, with its whole signature. So an item that goes, is
//! renamed or takes other arguments is a line that goes. With `BLESS=1` the list is written anew.
use crate::{failure::Failure, shell, toolchain};
use std::{collections::BTreeSet, env, fs, process::Command};

/// The committed list.
const LIST: &str = "crates/leadscrew/api.txt";

/// Lists the facade's items, and compares or writes the list.
///
/// # Errors
/// The lines that have come and gone.
pub(crate) fn run() -> Result<(), Failure> {
    let mut rustdoc = Command::new("cargo");
    rustdoc.args(["rustdoc", "--quiet", "-p", "leadscrew", "--lib"]);
    shell::run(rustdoc.current_dir(toolchain::root()))?;
    let now = listed()?;
    let path = toolchain::root().join(LIST);
    if env::var_os("BLESS").is_some() {
        let text: String = now.iter().map(|line| line.clone() + "\n").collect();
        return fs::write(&path, text).map_err(Failure::file(&path));
    }
    let text = fs::read_to_string(&path).map_err(Failure::file(&path))?;
    let before = text.lines().map(str::to_owned).collect();
    let findings = differences(&before, &now);
    println!("api: {} lines", now.len());
    match findings.is_empty() {
        true => Ok(()),
        false => Err(Failure::Findings(findings)),
    }
}

/// What has gone and come, if anything has.
fn differences(before: &BTreeSet<String>, now: &BTreeSet<String>) -> Vec<String> {
    let gone = before.difference(now).map(|line| format!("- {line}"));
    let come = now.difference(before).map(|line| format!("+ {line}"));
    let mut findings: Vec<String> = gone.chain(come).collect();
    if !findings.is_empty() {
        findings.push(format!(
            "{LIST}: the facade has changed; if that is meant, `BLESS=1 cargo xtask api`, and a \
             line in CHANGELOG.md for what has gone"
        ));
    }
    findings
}

/// The lines of all items, in order.
fn listed() -> Result<BTreeSet<String>, Failure> {
    let folder = toolchain::target_dir().join("doc/leadscrew");
    let page = |name: &str| {
        let path = folder.join(name);
        fs::read_to_string(&path).map_err(Failure::file(&path))
    };
    let mut lines = BTreeSet::new();
    let all = page("all.html")?;
    let links = all.split("<li><a href=\"").skip(1);
    for link in links.filter(|link| !link.starts_with('#')) {
        let unreadable = || Failure::unreadable("all.html", link);
        let (address, rest) = link.split_once("\">").ok_or_else(unreadable)?;
        let (name, _) = rest.split_once('<').ok_or_else(unreadable)?;
        lines.extend(item(name, &page(address)?));
    }
    let index = page("index.html")?;
    let others = index.split("id=\"reexport.").skip(1);
    lines.extend(others.filter_map(|rest| Some(format!("{}: pub use", rest.split_once('"')?.0))));
    match lines.is_empty() {
        true => Err(Failure::unreadable("all.html", "no items")),
        false => Ok(lines),
    }
}

/// The beginnings of signatures in a page: of the item, of an `impl` or a variant, of a method.
const MARKS: [&str; 3] = [
    "<pre class=\"rust item-decl\">",
    "<h3 class=\"code-header\">",
    "<h4 class=\"code-header\">",
];

/// The lines of an item's page.
fn item(name: &str, page: &str) -> Vec<String> {
    let mut lines = Vec::new();
    // The declaration comes before all sections.
    for (number, section) in page.split("<h2 id=\"").enumerate() {
        let id = section.split('"').next().unwrap_or_default();
        for (place, mark) in MARKS.into_iter().enumerate() {
            for rest in section.split(mark).skip(1) {
                let end = rest.find(if place == 0 { "</pre>" } else { "</h" });
                let text = plain(&rest[..end.unwrap_or(rest.len())]);
                let is_method = place == 2;
                if number == 0 || is_shown(id, is_method, &text) {
                    lines.push(format!("{name}: {text}"));
                }
            }
        }
    }
    lines
}

/// Returns whether a signature belongs to the list: not if it follows from others.
fn is_shown(section: &str, is_method: bool, text: &str) -> bool {
    match section {
        "trait-implementations" => !is_method || text.starts_with("type "),
        "synthetic-implementations" => text.contains("Send for ") || text.contains("Sync for "),
        _ => section == "implementations" || section.starts_with("deref-methods"),
    }
}

/// The text of a piece of HTML, in one line.
fn plain(html: &str) -> String {
    let mut text = String::new();
    for (number, piece) in html.split('<').enumerate() {
        let (tag, rest) = match number {
            0 => ("", piece),
            _ => piece.split_once('>').unwrap_or((piece, "")),
        };
        if tag.starts_with("div") || tag.starts_with("br") {
            text.push(' ');
        }
        text += rest;
    }
    for (code, character) in [
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&quot;", "\""),
        ("&#39;", "'"),
        ("&nbsp;", " "),
        ("&amp;", "&"),
    ] {
        text = text.replace(code, character);
    }
    let words: Vec<&str> = text.split_whitespace().collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str =
        "<pre class=\"rust item-decl\"><code>pub struct <a href=\"x\">Pen</a>;</code>\
        </pre><h2 id=\"implementations\" class=\"c\">I</h2>\
        <h3 class=\"code-header\">impl Pen</h3>\
        <h4 class=\"code-header\">pub fn <a>move_to</a>(\n    &amp;self,\n) -&gt; Option&lt;T&gt;\
        <div class=\"where\">where\n    T: Copy,</div></h4>\
        <h2 id=\"trait-implementations\"><h3 class=\"code-header\">impl Clone for Pen</h3>\
        <h4 class=\"code-header\">fn clone(&amp;self) -&gt; Self</h4>\
        <h4 class=\"code-header\">type Error = Fault</h4>\
        <h2 id=\"synthetic-implementations\"><h3 class=\"code-header\">impl Send for Pen</h3>\
        <h3 class=\"code-header\">impl Freeze for Pen</h3>\
        <h2 id=\"blanket-implementations\"><h3 class=\"code-header\">impl&lt;T&gt; Any for T</h3>";

    #[test]
    fn a_page_is_the_lines_of_its_signatures() {
        assert_eq!(
            item("Pen", PAGE),
            [
                "Pen: pub struct Pen;",
                "Pen: impl Pen",
                "Pen: pub fn move_to( &self, ) -> Option<T> where T: Copy,",
                "Pen: impl Clone for Pen",
                "Pen: type Error = Fault",
                "Pen: impl Send for Pen",
            ]
        );
    }

    #[test]
    fn an_item_that_goes_is_renamed_or_changes_its_signature_is_a_finding() {
        let set = |page: &str| BTreeSet::from_iter(item("Pen", page));
        let before = set(PAGE);
        assert!(differences(&before, &set(PAGE)).is_empty());
        for (old, new) in [
            ("move_to", "go_to"),
            ("&amp;self,", "&amp;mut self,"),
            ("Option", "Result"),
            ("<h3 class=\"code-header\">impl Clone for Pen</h3>", ""),
            ("impl Send for", "impl !Send for"),
        ] {
            let findings = differences(&before, &set(&PAGE.replacen(old, new, 1)));
            assert!(findings[0].starts_with("- Pen: "), "{findings:?}");
            assert!(findings.last().unwrap().contains("BLESS=1"));
        }
    }
}
