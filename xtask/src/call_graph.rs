//! The functions that one function can reach, read from the disassembly of the linked program.
//!
//! The disassembly must be of the program that is flashed. A second program that links the step
//! interrupt alone would not do, because optimisation across crates decides which functions are
//! inlined and which routines are called.
//!
//! The disassembly does not show the target of a call through a register. So each such call is a
//! finding, too.
//!
//! The disassembly is the output of `arm-none-eabi-objdump -d --no-show-raw-insn`:
//!
//! ```text
//! 0800c100 <TIM2>:
//!  800c100:    push    {r7, lr}
//!  800c102:    bl      800c200 <tick>
//! ```
use std::collections::{BTreeMap, BTreeSet};

/// A function of the program: its address, the symbols that it mentions, and the call through a
/// register in it, if there is one.
#[derive(Debug, Default)]
struct Function {
    address: u64,
    mentions: BTreeSet<String>,
    computed_call: Option<String>,
}

/// The functions of a program by symbol.
#[derive(Debug, Default)]
pub(crate) struct CallGraph(BTreeMap<String, Function>);

/// A path from the entry to something that must not be reachable.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Finding {
    /// The symbols from the entry to the end of the path, in order of the calls.
    pub(crate) path: Vec<String>,
    /// The fault at the end of the path.
    pub(crate) reason: String,
}

impl CallGraph {
    /// Reads a disassembly.
    pub(crate) fn parse(disassembly: &str) -> Self {
        let mut functions: BTreeMap<String, Function> = BTreeMap::new();
        let mut current = String::new();
        for line in disassembly.lines() {
            if let Some((address, symbol)) = heading(line) {
                current = symbol.to_owned();
                functions.entry(current.clone()).or_default().address = address;
            } else if let Some(function) = functions.get_mut(&current) {
                function.read(&current, line);
            }
        }
        CallGraph(functions)
    }

    /// Returns true if the program has a function of this name.
    pub(crate) fn contains(&self, symbol: &str) -> bool {
        self.0.contains_key(symbol)
    }

    /// Number of functions that `entry` can reach, itself included.
    pub(crate) fn reach(&self, entry: &str) -> usize {
        self.paths_from(entry, |_| true).len()
    }

    /// Everything that `entry` can reach and must not: computed calls, and symbols for which
    /// `forbidden` has a reason. The search does not go beyond such a symbol.
    pub(crate) fn findings(
        &self,
        entry: &str,
        forbidden: impl Fn(&str) -> Option<&'static str>,
    ) -> Vec<Finding> {
        let mut findings = Vec::new();
        for (symbol, path) in self.paths_from(entry, |symbol| forbidden(symbol).is_none()) {
            let reason = forbidden(symbol)
                .map(str::to_owned)
                .or_else(|| self.computed_call(symbol));
            findings.extend(reason.map(|reason| Finding { path, reason }));
        }
        findings
    }

    /// The functions at addresses from `begin` on that `entry` can reach, `entry` included.
    pub(crate) fn reach_beyond(&self, entry: &str, begin: u64) -> Vec<Finding> {
        let paths = self.paths_from(entry, |_| true).into_iter();
        let beyond = paths.filter(|(symbol, _)| {
            let function = self.0.get(*symbol);
            function.is_some_and(|function| function.address >= begin)
        });
        beyond
            .map(|(_, path)| Finding {
                path,
                reason: "runs from the flash".into(),
            })
            .collect()
    }

    /// The fault of a function, if it calls through a register.
    fn computed_call(&self, symbol: &str) -> Option<String> {
        let instruction = self.0.get(symbol)?.computed_call.as_ref()?;
        Some(format!("calls through a register: `{instruction}`"))
    }

    /// A shortest path to each symbol that `entry` can reach through symbols that are `passable`.
    fn paths_from<'a>(
        &'a self,
        entry: &'a str,
        passable: impl Fn(&str) -> bool,
    ) -> BTreeMap<&'a str, Vec<String>> {
        let mut paths = BTreeMap::from([(entry, vec![entry.to_owned()])]);
        let mut frontier = vec![entry];
        while !frontier.is_empty() {
            let mut next = Vec::new();
            for symbol in frontier.into_iter().filter(|symbol| passable(symbol)) {
                let path = paths[symbol].clone();
                for callee in self
                    .0
                    .get(symbol)
                    .into_iter()
                    .flat_map(|function| &function.mentions)
                {
                    if !paths.contains_key(callee.as_str()) {
                        let longer = path.iter().chain([callee]).cloned().collect();
                        paths.insert(callee, longer);
                        next.push(callee.as_str());
                    }
                }
            }
            frontier = next;
        }
        paths
    }
}

impl Function {
    /// Reads one instruction of the function `own`.
    fn read(&mut self, own: &str, line: &str) {
        let Some((_address, instruction)) = line.split_once(':') else {
            return;
        };
        if let Some(symbol) = mentioned_symbol(instruction).filter(|symbol| *symbol != own) {
            self.mentions.insert(symbol.to_owned());
        }
        if is_computed_call(instruction) {
            self.computed_call = Some(instruction.split_whitespace().collect::<Vec<_>>().join(" "));
        }
    }
}

/// 0x0800c200 and `tick` from a line like `0800c200 <tick>:`.
fn heading(line: &str) -> Option<(u64, &str)> {
    let (address, rest) = line.split_once(" <")?;
    Some((
        u64::from_str_radix(address, 16).ok()?,
        rest.strip_suffix(">:")?,
    ))
}

/// `tick` from `bl 800c200 <tick>` and from `b.n 800c210 <tick+0x10>`: every mention of a symbol
/// counts as a call.
fn mentioned_symbol(instruction: &str) -> Option<&str> {
    let (_, rest) = instruction.split_once('<')?;
    let (name, _) = rest.rsplit_once('>')?;
    Some(name.rsplit_once("+0x").map_or(name, |(symbol, _)| symbol))
}

/// Returns true if an instruction jumps to an address that is computed. Returns (`bx lr`) and jump
/// tables inside a function (`tbb`, `tbh`) are not calls.
fn is_computed_call(instruction: &str) -> bool {
    let mut words = instruction.split_whitespace();
    let mnemonic = words.next().unwrap_or_default();
    let operand = words.next().unwrap_or_default();
    let writes_pc = operand == "pc," && !mnemonic.starts_with("cmp");
    match mnemonic.split('.').next().unwrap_or_default() {
        name if name.starts_with("blx") => {
            operand.starts_with('r') || operand == "ip" || operand == "lr"
        }
        name if name.starts_with("bx") => operand != "lr",
        _ => writes_pc,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLEAN: &str = "
program:     file format elf32-littlearm

0800c100 <TIM2>:
 800c100:\tpush\t{r7, lr}
 800c102:\tbl\t800c200 <leadscrew_stepper::tick>
 800c106:\tbeq.n\t800c10a <TIM2+0xa>
 800c108:\tldr\tr0, [pc, #4]\t@ (800c110 <TIM2+0x10>)
 800c10a:\tpop\t{r7, pc}

0800c200 <leadscrew_stepper::tick>:
 800c200:\ttbb\t[pc, r0]
 800c204:\tudiv\tr0, r0, r1
 800c208:\tbx\tlr

0800c300 <main>:
 800c300:\tbl\t800c400 <__aeabi_uldivmod>
 800c304:\tblx\tr3

0800c400 <__aeabi_uldivmod>:
 800c400:\tbx\tlr
";

    fn no_division(symbol: &str) -> Option<&'static str> {
        (symbol == "__aeabi_uldivmod").then_some("divides")
    }

    fn planted(instruction: &str) -> Vec<Finding> {
        let text = CLEAN.replace("udiv\tr0, r0, r1", instruction);
        assert_ne!(text, CLEAN);
        CallGraph::parse(&text).findings("TIM2", no_division)
    }

    #[test]
    fn what_runs_from_the_flash_is_found_with_its_path() {
        let text = CLEAN.replace("0800c100 <TIM2>", "00000188 <TIM2>");
        let found = CallGraph::parse(&text).reach_beyond("TIM2", 0x0800_0000);
        let paths: Vec<String> = found.iter().map(|found| found.path.join(" ")).collect();
        assert_eq!(paths, ["TIM2 leadscrew_stepper::tick"]);
    }

    #[test]
    fn what_only_the_main_loop_reaches_is_no_finding() {
        let graph = CallGraph::parse(CLEAN);
        assert_eq!(graph.findings("TIM2", no_division), []);
        assert_eq!(graph.reach("TIM2"), 2);
    }

    #[test]
    fn the_main_loop_is_found_guilty_of_its_division_and_of_its_computed_call() {
        assert_eq!(
            CallGraph::parse(CLEAN).findings("main", no_division).len(),
            2
        );
    }

    #[test]
    fn a_division_planted_two_calls_deep_is_found_with_its_path() {
        let findings = planted("bl\t800c400 <__aeabi_uldivmod>");
        let path = ["TIM2", "leadscrew_stepper::tick", "__aeabi_uldivmod"]
            .map(str::to_owned)
            .to_vec();
        assert_eq!(
            findings,
            [Finding {
                path,
                reason: "divides".to_owned()
            }]
        );
    }

    #[test]
    fn what_lies_behind_a_forbidden_symbol_is_no_further_finding() {
        let text = CLEAN
            .replace("udiv\tr0, r0, r1", "bl\t800c400 <__aeabi_uldivmod>")
            .replace("800c400:\tbx\tlr", "800c400:\tbl\t800c300 <main>");
        assert_eq!(
            CallGraph::parse(&text).findings("TIM2", no_division).len(),
            1
        );
    }

    #[test]
    fn a_tail_call_into_the_middle_of_a_function_is_a_call() {
        assert_eq!(planted("b.w\t800c402 <__aeabi_uldivmod+0x2>").len(), 1);
    }

    #[test]
    fn a_conditional_branch_is_a_call() {
        assert_eq!(planted("bne.w\t800c400 <__aeabi_uldivmod>").len(), 1);
    }

    #[test]
    fn each_way_to_call_through_a_register_is_found() {
        for instruction in [
            "blx\tr3",
            "blx\tip",
            "bx\tr2",
            "bxne\tr2",
            "mov\tpc, r3",
            "ldr.w\tpc, [r0, r1, lsl #2]",
        ] {
            assert_eq!(planted(instruction).len(), 1, "{instruction}");
        }
    }

    #[test]
    fn returns_are_no_computed_calls() {
        for instruction in [
            "bx\tlr",
            "pop\t{r4, pc}",
            "ldmia.w\tsp!, {r4, pc}",
            "tbh\t[pc, r1, lsl #1]",
        ] {
            assert_eq!(planted(instruction), [], "{instruction}");
        }
    }

    #[test]
    fn a_symbol_that_calls_itself_ends_the_walk() {
        assert_eq!(planted("bl\t800c100 <TIM2>"), []);
    }
}
