//! Reads ST's register data from the generated source of the crate `stm32f4` in cargo's registry.
//! Nothing of it is copied here.
use std::{
    collections::BTreeMap,
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// A register in ST's data.
#[derive(Clone, Debug)]
pub(super) struct Register {
    pub(super) name: String,
    pub(super) reset: u32,
    /// The bits that are read, and the bits that are written.
    pub(super) read: u32,
    pub(super) write: u32,
    /// The bits that writing a one clears, and the bits that writing a zero clears.
    pub(super) cleared_by_one: u32,
    pub(super) cleared_by_zero: u32,
}

/// The registers, by address, of the peripherals that `is_wanted` selects by name and address.
pub(super) fn registers(is_wanted: impl Fn(&str, u32) -> bool) -> BTreeMap<u32, Register> {
    let root = source();
    let text = read(&root.join("mod.rs"));
    let mut all = BTreeMap::new();
    for line in text.lines().filter(|line| line.contains("crate::Periph<")) {
        let words: Vec<&str> = line.split([' ', '<', '>', ',', ':', ';']).collect();
        let name = words[2];
        let module = words[words.iter().position(|word| *word == "Periph").unwrap() + 1];
        let base = words.iter().rev().find_map(|word| number(word)).unwrap();
        if is_wanted(name, base) {
            let block = root.join(format!("{module}.rs"));
            Block::read(&root, &block).add_to(&mut all, name, base);
        }
    }
    all
}

/// The folder with the generated source of the STM32F407.
fn source() -> PathBuf {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version=1", "--locked"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo says where packages are");
    let text = String::from_utf8(output.stdout).expect("text");
    let package = text
        .split_once(r#""name":"stm32f4","version":"#)
        .expect("the firmware needs stm32f4")
        .1;
    let manifest = package.split_once(r#""manifest_path":""#).unwrap().1;
    let path = manifest.split('"').next().unwrap();
    Path::new(path).with_file_name("src/stm32f407")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn number(word: &str) -> Option<u32> {
    let word = word.replace('_', "");
    match word.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => word.parse().ok(),
    }
}

/// A register block, or a cluster in a block.
struct Block<'a> {
    root: &'a Path,
    /// The folder with the files of its registers.
    folder: PathBuf,
    text: String,
}

/// The result of an accessor: one register or cluster, or several of them one after the other.
struct Member<'a> {
    offset: u32,
    stride: u32,
    count: u32,
    of_type: &'a str,
    name: &'a str,
}

impl<'a> Block<'a> {
    fn read(root: &'a Path, file: &Path) -> Self {
        Block {
            root,
            folder: file.with_extension(""),
            text: read(file),
        }
    }

    fn add_to(&self, all: &mut BTreeMap<u32, Register>, name: &str, base: u32) {
        for member in self.members() {
            let file = self.file(member.of_type);
            let text = read(&file);
            for index in 0..member.count {
                let address = base + member.offset + index * member.stride;
                let mut name = format!("{name}.{}", member.name.to_uppercase());
                if member.count > 1 {
                    name += &format!("[{index}]");
                }
                if text.contains("impl crate::RegisterSpec for") {
                    add(all, address, register(name, &text));
                } else {
                    Block::read(self.root, &file).add_to(all, &name, address);
                }
            }
        }
    }

    /// The file of a register or cluster, which may be shared between peripherals.
    fn file(&self, of_type: &str) -> PathBuf {
        let name = format!("{}.rs", of_type.to_lowercase());
        let elsewhere = self.text.lines().find_map(|line| {
            let path = line.strip_prefix("pub use crate::stm32f407::")?;
            path.strip_suffix(&format!("::{of_type};"))
        });
        match elsewhere {
            Some(path) => self.root.join(path.replace("::", "/")).join(name),
            None => self.folder.join(name),
        }
    }

    /// The registers and clusters that the accessors return. The first line above an accessor has
    /// its offset.
    fn members(&self) -> Vec<Member<'_>> {
        let mut members = Vec::new();
        let mut place = None;
        for line in self.text.lines().map(str::trim) {
            if let Some(range) = line.strip_prefix("///0x") {
                place = Some(range.split(' ').next().unwrap());
            } else if let Some(signature) = line.strip_prefix("pub const fn ") {
                members.extend(place.take().and_then(|place| self.member(place, signature)));
            }
        }
        members
    }

    /// `place` has the digits of the offset; for a cluster or an array also the digits of the end.
    fn member<'t>(&self, place: &str, signature: &'t str) -> Option<Member<'t>> {
        let hex = |digits| u32::from_str_radix(digits, 16).unwrap();
        let (name, rest) = signature.split_once('(')?;
        let of_type = rest.split_once("-> &")?.1.split(' ').next()?;
        let (begin, end) = match place.split_once("..0x") {
            Some((begin, end)) => (hex(begin), hex(end)),
            None => (hex(place), 0),
        };
        let count = match rest.contains("n: usize") {
            true => self.length(name),
            false => 1,
        };
        Some(Member {
            offset: begin,
            stride: end.saturating_sub(begin) / count,
            count,
            of_type,
            name,
        })
    }

    /// The length of the array `name: [TYPE; LENGTH],`.
    fn length(&self, name: &str) -> u32 {
        let begin = format!("{name}: [");
        let field = self
            .text
            .lines()
            .map(str::trim)
            .find(|line| line.starts_with(&begin));
        let length = field.and_then(|line| line.split(['[', ';', ']']).nth(2));
        length.and_then(|length| number(length.trim())).unwrap()
    }
}

/// Adds a register. Several views of the same register are united: a capture channel is a compare
/// channel as well.
fn add(all: &mut BTreeMap<u32, Register>, address: u32, register: Register) {
    let known = all.entry(address).or_insert_with(|| register.clone());
    known.read |= register.read;
    known.write |= register.write;
}

fn register(name: String, text: &str) -> Register {
    let value = |begin: &str| {
        let line = text
            .lines()
            .map(str::trim)
            .find(|line| line.starts_with(begin));
        let value = line.and_then(|line| line.split(['=', ';']).nth(1));
        value.and_then(|value| number(value.trim())).unwrap_or(0)
    };
    Register {
        name,
        reset: value("const RESET_VALUE"),
        read: bits(text, "impl R {"),
        write: bits(text, "impl W {"),
        cleared_by_one: value("const ONE_TO_MODIFY"),
        cleared_by_zero: value("const ZERO_TO_MODIFY"),
    }
}

/// The bits of the fields of a reader or a writer, from lines like `///Bit 3 - ...` and `///Bits
/// 4:7 - ...`.
fn bits(text: &str, begin: &str) -> u32 {
    let lines = text.lines().skip_while(|line| *line != begin);
    let ours = lines.take_while(|line| *line != "}").map(str::trim);
    ours.filter_map(|line| line.strip_prefix("///Bit"))
        .filter_map(|rest| rest.trim_start_matches('s').trim().split(' ').next())
        .filter_map(|range| {
            let (first, last) = range.split_once(':').unwrap_or((range, range));
            Some((first.parse::<u32>().ok()?, last.parse::<u32>().ok()?))
        })
        .fold(0, |all, (first, last)| {
            all | u32::MAX << first & u32::MAX >> (31 - last)
        })
}
