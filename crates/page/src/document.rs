//! The page as one document: it contains its style and its modules, and fetches nothing.
//!
//! Modules import each other by bare names. An import map leads each name to the module's text as a
//! `data:` address, so that the document also works from a file.

use data_encoding::BASE64;
use serde_json::json;
use std::fmt::Write as _;
use std::sync::LazyLock;

/// A module: the name that others import it by, and its text.
type Module = (&'static str, &'static str);

/// The modules of both documents.
const COMMON: [Module; 8] = [
    ("camera", include_str!("../web/camera.js")),
    ("colours", include_str!("../web/colours.js")),
    ("course", include_str!("../web/course.js")),
    ("dom", include_str!("../web/dom.js")),
    ("legend", include_str!("../web/legend.js")),
    ("scene", include_str!("../web/scene.js")),
    ("strokes", include_str!("../web/strokes.js")),
    ("view", include_str!("../web/view.js")),
];

/// Modules that only the page of a machine has. The module that reaches the machine is added to
/// them.
const MACHINE: [Module; 35] = [
    ("ask", include_str!("../web/ask.js")),
    ("backup", include_str!("../web/backup.js")),
    ("begin", include_str!("../web/begin.js")),
    ("board", include_str!("../web/board.js")),
    ("chart", include_str!("../web/chart.js")),
    ("connect", include_str!("../web/connect.js")),
    ("corner", include_str!("../web/corner.js")),
    ("dialogues", include_str!("../web/dialogues.js")),
    ("enable", include_str!("../web/enable.js")),
    ("files", include_str!("../web/files.js")),
    ("frames", include_str!("../web/frames.js")),
    ("framing", include_str!("../web/framing.js")),
    ("gamepad", include_str!("../web/gamepad.js")),
    ("grbl", include_str!("../web/grbl.js")),
    ("head", include_str!("../web/head.js")),
    ("heights", include_str!("../web/heights.js")),
    ("job", include_str!("../web/job.js")),
    ("jog", include_str!("../web/jog.js")),
    ("keys", include_str!("../web/keys.js")),
    ("life", include_str!("../web/life.js")),
    ("machines", include_str!("../web/machines.js")),
    ("macros", include_str!("../web/macros.js")),
    ("main", include_str!("../web/main.js")),
    ("overheard", include_str!("../web/overheard.js")),
    ("panels", include_str!("../web/panels.js")),
    ("perform", include_str!("../web/perform.js")),
    ("picture", include_str!("../web/picture.js")),
    ("program", include_str!("../web/program.js")),
    ("scrub", include_str!("../web/scrub.js")),
    ("sender", include_str!("../web/sender.js")),
    ("serial", include_str!("../web/serial.js")),
    ("state", include_str!("../web/state.js")),
    ("theme", include_str!("../web/theme.js")),
    ("touch", include_str!("../web/touch.js")),
    ("units", include_str!("../web/units.js")),
];

/// The module that reaches a machine through a server.
const SOCKET: Module = ("link", include_str!("../web/link.js"));

/// The module that reaches a machine in the browser. Other modules use it as they use [`SOCKET`].
const WORKERS: Module = ("link", include_str!("../web/local.js"));

/// The script of the workers of [`WORKERS`].
const WORKER: &str = include_str!("../web/worker.js");

/// Modules that only the page of a finished job has.
const PLAYER: [Module; 1] = [("main", include_str!("../web/player.js"))];

const PAGE: &str = include_str!("../web/page.html");
const PLAYER_PAGE: &str = include_str!("../web/player.html");
const STYLE: &str = include_str!("../web/style.css");

/// The placeholder for a nonce, different in each answer, by which the browser recognises the
/// page's own scripts.
const NONCE: &str = "NONCE";

/// The placeholder for a document's data.
const DATA: &str = "<!--data-->";

static DOCUMENT: LazyLock<String> = LazyLock::new(|| {
    let own: Vec<Module> = MACHINE.into_iter().chain([SOCKET]).collect();
    compose(PAGE, &own).replace(DATA, "")
});

/// Returns the document; its scripts run if the answer's headers allow scripts with this `nonce`.
pub fn document(nonce: &str) -> String {
    DOCUMENT.replace(NONCE, nonce)
}

/// A finished job as a document of its own, with a slider along its time. It fetches nothing and
/// works from a file.
pub struct Playback<'a> {
    /// The job's name.
    pub title: &'a str,
    /// One line of figures.
    pub summary: &'a str,
    /// The tool's work on the material: `cut` or `extruded`.
    pub work: &'a str,
    /// True if `power` of the moves is a laser's power.
    pub is_laser: bool,
    /// The moves, [`Drawn`](leadscrew_sim::scene::Drawn)s; the first is the beginning of the path.
    pub moves: &'a [u8],
    /// The lengths of the moves along all axes, mm; f32, little-endian.
    pub lengths: &'a [u8],
    /// The stretches of constant acceleration, each as time in s, length in mm, and speed at the
    /// begin in mm/s; f32, little-endian.
    pub course: &'a [u8],
}

impl Playback<'_> {
    /// Returns the document.
    pub fn document(&self) -> String {
        let facts = json!({
            "title": self.title,
            "summary": self.summary,
            "work": self.work,
            "laser": self.is_laser,
            "letters": ["X", "Y", "Z"],
        });
        // A script element ends at the first `</script`, even within a string.
        let mut data = element("facts", &facts.to_string().replace('<', "\\u003c"));
        for (id, bytes) in [
            ("moves", self.moves),
            ("lengths", self.lengths),
            ("course", self.course),
        ] {
            data.push_str(&element(id, &BASE64.encode(bytes)));
        }
        compose(PLAYER_PAGE, &PLAYER)
            .replace(&format!(" nonce=\"{NONCE}\""), "")
            .replace(DATA, &data)
    }
}

/// The page of a machine that contains the simulator. It fetches nothing and works from a file.
pub struct Standalone<'a> {
    /// The module of `leadscrew-wasm`, compressed with gzip.
    pub simulator: &'a [u8],
    /// The machine file.
    pub machine: &'a str,
}

impl Standalone<'_> {
    /// Returns the document.
    pub fn document(&self) -> String {
        let own: Vec<Module> = MACHINE.into_iter().chain([WORKERS]).collect();
        let data = [
            // A script element ends at the first `</script`, even within a string.
            ("machine", BASE64.encode(self.machine.as_bytes())),
            ("worker", BASE64.encode(bare(WORKER).as_bytes())),
            ("simulator", BASE64.encode(self.simulator)),
        ];
        let data: String = data.iter().map(|(id, text)| element(id, text)).collect();
        compose(PAGE, &own)
            .replace(&format!(" nonce=\"{NONCE}\""), "")
            .replace(DATA, &data)
    }
}

fn element(id: &str, text: &str) -> String {
    format!("<script type=\"text/plain\" id=\"{id}\">{text}</script>\n")
}

/// A page of HTML with the style, the common modules and its `own` modules; `main` among them is
/// run first.
fn compose(page: &str, own: &[Module]) -> String {
    let mut map = String::new();
    for (name, text) in COMMON.iter().chain(own) {
        let comma = if map.is_empty() { "" } else { "," };
        // Writing to a string cannot fail.
        let _ = write!(
            map,
            "{comma}\n\"{name}\": \"data:text/javascript,{}\"",
            quoted(&bare(text))
        );
    }
    let modules = format!(
        "<script type=\"importmap\" nonce=\"{NONCE}\">{{\"imports\": {{{map}\n}}}}</script>\n\
        <script type=\"module\" nonce=\"{NONCE}\">import \"main\";</script>"
    );
    page.replace("<!--style-->", &format!("<style>\n{STYLE}</style>"))
        .replace("<!--modules-->", &modules)
}

/// A module without its comments and indentation, which a browser has no use for. Comments are whole
/// lines, or between `/**` and `*/`; no string holds these marks.
fn bare(text: &str) -> String {
    let mut parts = text.split("/**");
    let mut code = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        code.push_str(part.split_once("*/").map_or(part, |(_, code)| code));
    }
    let lines = code.lines().map(str::trim);
    let lines = lines.filter(|line| !line.is_empty() && !line.starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// A text as part of a `data:` address, which stands in a JSON string in a script element (RFC
/// 3986, section 2.1).
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
    fn comments_stay_behind_and_code_goes_along() {
        let text = "// @ts-check\n/**\n * @param {X} x\n */\nlet a = /** @type {Y} */ (by(\"a // b\"));\n\n  a.b();\n";
        assert_eq!(bare(text), "let a =  (by(\"a // b\"));\na.b();");
        for document in [document(""), playback(), standalone()] {
            assert!(!document.contains("@type") && !document.contains("@param"));
        }
    }

    fn playback() -> String {
        let job = Playback {
            title: "a </script> b",
            summary: "1 s",
            work: "cut",
            is_laser: false,
            moves: &[0; 40],
            lengths: &[0; 8],
            course: &[0; 12],
        };
        job.document()
    }

    fn standalone() -> String {
        let page = Standalone {
            simulator: b"a module",
            machine: "name = \"</script>\"",
        };
        page.document()
    }

    #[test]
    fn a_page_without_a_server_is_whole_and_its_machine_ends_no_element() {
        let document = standalone();
        assert!(!document.contains("<!--") && !document.contains(NONCE));
        // The script elements are the machine, the worker, the simulator, the import map and the
        // first module.
        assert_eq!(document.matches("</script>").count(), 5);
        let data = document.split("id=\"simulator\">").nth(1).unwrap();
        assert!(data.starts_with("YSBtb2R1bGU=</script>"));
    }

    #[test]
    fn nothing_is_fetched() {
        for document in [document(""), playback(), standalone()] {
            for address in ["src=\"http", "href=\"http", "url(", "@import", "fetch("] {
                assert!(!document.contains(address), "{address}");
            }
        }
    }

    #[test]
    fn a_finished_job_is_whole_and_its_name_ends_no_element() {
        let document = playback();
        assert!(!document.contains("<!--") && !document.contains(NONCE));
        assert!(document.contains("a \\u003c/script> b"));
        // The script elements are facts, moves, lengths, course, the import map and the first
        // module.
        assert_eq!(document.matches("</script>").count(), 6);
        let data = document.split("id=\"lengths\">").nth(1).unwrap();
        assert!(data.starts_with("AAAAAAAAAAA=</script>"));
    }

    #[test]
    fn every_module_that_is_imported_is_there() {
        let of_machine = |link| MACHINE.into_iter().chain([link]).collect::<Vec<_>>();
        for own in [of_machine(SOCKET), of_machine(WORKERS), PLAYER.to_vec()] {
            let all: Vec<&str> = COMMON.iter().chain(&own).map(|(name, _)| *name).collect();
            for (name, text) in COMMON.iter().chain(&own) {
                let imports = text.lines().filter_map(|line| line.strip_prefix("import "));
                for import in imports {
                    let from = import.split('"').nth(1).unwrap();
                    assert!(all.contains(&from), "{name} imports {from}");
                }
            }
        }
    }
}
