//! `cargo xtask circles`: files of a crate that import each other in a circle.
//!
//! ```text
//!   a.rs --uses--> b.rs --uses--> c.rs --uses--> a.rs      none of the three can be read first
//! ```
//!
//! A file may use its parent (`a/b.rs` uses `a.rs`), and a parent its children: they are read
//! together. Tests are left out. Paths are read from the text, so a path that only a macro makes is
//! not seen.
use crate::{failure::Failure, toolchain};
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// The place of a file's module in its crate: `["ahead", "map"]`; empty for `lib.rs`.
type Module = Vec<String>;

/// A path that a file names, from the root of its crate.
struct Import {
    path: Module,
    /// True if it is a `pub use`: its last name can be found in the file's module, too.
    is_public: bool,
}

type Files = BTreeMap<Module, Vec<Import>>;

/// Looks for circles in each crate, and prints how many files it has read.
pub(crate) fn run() -> Result<(), Failure> {
    let crates = toolchain::root().join("crates");
    let (mut findings, mut count) = (Vec::new(), 0);
    for entry in fs::read_dir(&crates).map_err(Failure::file(&crates))? {
        let entry = entry.map_err(Failure::file(&crates))?;
        let mut files = Files::new();
        read(&entry.path().join("src"), &Module::new(), &mut files)?;
        count += files.len();
        for circle in circles(&files) {
            let names: Vec<String> = circle.iter().map(|module| module.join("::")).collect();
            findings.push(format!(
                "{}: these files import each other: {}",
                entry.file_name().to_string_lossy(),
                names.join(", ")
            ));
        }
    }
    println!("circles: {count} files read");
    match findings.is_empty() {
        true => Ok(()),
        false => Err(Failure::Findings(findings)),
    }
}

/// Reads the files of the folder of `module`, and of the folders in it.
fn read(folder: &Path, module: &Module, files: &mut Files) -> Result<(), Failure> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Ok(()); // a crate without sources
    };
    for entry in entries {
        let path = entry.map_err(Failure::file(folder))?.path();
        let Some(name) = path
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned())
        else {
            continue;
        };
        let own = match name.as_str() {
            "lib" | "main" | "mod" => module.clone(),
            _ => [module.as_slice(), std::slice::from_ref(&name)].concat(),
        };
        if name.ends_with("tests") {
            continue;
        }
        if path.is_dir() {
            read(&path, &own, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).map_err(Failure::file(&path))?;
            files.insert(own.clone(), imports(&text, &own));
        }
    }
    Ok(())
}

/// The paths within the crate that a file names.
fn imports(text: &str, own: &Module) -> Vec<Import> {
    let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let code: Vec<&str> = code
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect();
    let code = code.join(" ");
    let mut found = Vec::new();
    for statement in code.split(';') {
        if let Some((before, tree)) = statement.rsplit_once("use ") {
            let is_public = before.trim_end().ends_with(['b', ')']) && before.contains("pub");
            for path in branches(tree) {
                found.extend(absolute(&path, own).map(|path| Import { path, is_public }));
            }
        }
    }
    for (place, _) in code.match_indices("crate::") {
        let is_part = |letter: char| letter.is_alphanumeric() || letter == '_' || letter == ':';
        let path = code[place..].split(|letter| !is_part(letter)).next();
        found.extend(
            path.and_then(|path| absolute(path, own))
                .map(|path| Import {
                    path,
                    is_public: false,
                }),
        );
    }
    found
}

/// The paths of a tree: `a::{b, c::d}` has `a::b` and `a::c::d`.
fn branches(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((stem, rest)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default();
        return vec![path.replace(' ', "")];
    };
    let inner = rest.rsplit_once('}').map_or(rest, |(inner, _)| inner);
    let (mut depth, mut parts, mut part) = (0, Vec::new(), String::new());
    for letter in inner.chars() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if letter == ',' && depth == 0 {
            parts.push(std::mem::take(&mut part));
        } else {
            part.push(letter);
        }
    }
    parts.push(part);
    parts
        .iter()
        .filter(|part| !part.trim().is_empty())
        .flat_map(|part| branches(part))
        .map(|branch| format!("{}{branch}", stem.trim()))
        .collect()
}

/// A path from the crate's root. A path that begins with another crate is taken for one within the
/// file: it leads nowhere else.
fn absolute(path: &str, own: &Module) -> Option<Module> {
    let mut names = path.split("::").filter(|name| !name.is_empty()).peekable();
    let mut base = match *names.peek()? {
        "crate" => Module::new(),
        _ => own.clone(),
    };
    for name in names {
        match name {
            "crate" | "self" => {}
            "super" => {
                base.pop()?;
            }
            _ => base.push(name.to_owned()),
        }
    }
    Some(base)
}

/// The file that a path leads to, by way of `pub use` if necessary.
fn file_of(path: &[String], files: &Files, depth: usize) -> Option<Module> {
    let length = (0..=path.len())
        .rev()
        .find(|length| files.contains_key(&path[..*length]))?;
    let module = path[..length].to_vec();
    let name = path.get(length);
    let mut again = files[&module].iter().filter(|import| import.is_public);
    let again = again.find(|import| import.path.last() == name && import.path != path);
    match (again, name) {
        (Some(import), Some(_)) if depth < 8 => {
            let further = [import.path.as_slice(), &path[length + 1..]].concat();
            file_of(&further, files, depth + 1)
        }
        _ => Some(module),
    }
}

/// The sets of files that lead to each other.
fn circles(files: &Files) -> Vec<BTreeSet<Module>> {
    let uses: BTreeMap<&Module, BTreeSet<Module>> = files
        .iter()
        .map(|(own, imports)| {
            let to = imports
                .iter()
                .filter_map(|import| file_of(&import.path, files, 0));
            (own, to.filter(|to| !own.starts_with(to)).collect())
        })
        .collect();
    let reached = |from: &Module| {
        let (mut known, mut open) = (BTreeSet::new(), vec![from.clone()]);
        while let Some(next) = open.pop() {
            for to in uses.get(&next).into_iter().flatten() {
                if known.insert(to.clone()) {
                    open.push(to.clone());
                }
            }
        }
        known
    };
    let reach: BTreeMap<&Module, BTreeSet<Module>> =
        files.keys().map(|file| (file, reached(file))).collect();
    let circle = |file: &Module| -> BTreeSet<Module> {
        let back = |other: &&Module| reach[*other].contains(file);
        reach[file].iter().filter(back).cloned().collect()
    };
    let all: BTreeSet<BTreeSet<Module>> = files.keys().map(circle).collect();
    all.into_iter().filter(|circle| circle.len() > 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> Vec<BTreeSet<Module>> {
        let module = |name: &str| name.split("::").map(str::to_owned).collect::<Module>();
        let files = files.iter().map(|(name, text)| {
            let own = if name.is_empty() {
                Module::new()
            } else {
                module(name)
            };
            (own.clone(), imports(text, &own))
        });
        circles(&files.collect())
    }

    #[test]
    fn a_circle_is_found_through_a_re_export_and_a_nested_tree() {
        let circle = found(&[
            ("", "pub use a::A;\npub use crate::a::A;"),
            ("a", "use crate::{b::{B, C}, other};\npub struct A;"),
            ("b", "use crate::A;\nuse core::fmt;"),
        ]);
        assert_eq!(circle.len(), 1, "{circle:?}");
        assert_eq!(circle[0].len(), 2);
    }

    #[test]
    fn parents_and_children_comments_and_tests_make_no_circle() {
        let circle = found(&[
            ("a", "use self::b::B;"),
            ("a::b", "use super::A; // use crate::c::C;"),
            ("c", "use crate::a::A;\n#[cfg(test)]\nmod tests {}"),
            (
                "d",
                "use crate::c::C;\n#[cfg(test)]\nmod tests { use crate::e::E; }",
            ),
            ("e", "use crate::d::D;"),
        ]);
        assert!(circle.is_empty(), "{circle:?}");
    }
}
