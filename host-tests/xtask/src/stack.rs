//! Upper bound of an image's stack, from its machine code.
//!
//! It parses stack use and calls of each function in the disassembly by `llvm-objdump`. A call through a pointer may
//! reach any function whose address is in the image's constants. Of these functions, the one with the largest stack is
//! assumed. An interrupt may occur at the deepest point; handlers of one priority do not nest. Recursion has no bound
//! and is an error.

use std::collections::{BTreeMap, BTreeSet};

/// Stack use of one function of an image, and the functions that it calls.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Function {
    /// Mangled name of the function.
    pub name: String,
    /// Size of the function's own stack frame, bytes.
    pub frame: u64,
    /// Addresses of the functions that this function calls or jumps to.
    pub calls: BTreeSet<u64>,
    /// True if the function calls any function through a pointer.
    pub indirect: bool,
}

/// Reason why the stack has no bound. Each variant has the function's name.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StackError {
    /// The function can call itself, directly or not.
    Recursion(String),
    /// The function's stack frame has no constant size.
    Dynamic(String),
    /// The image has no function with this name.
    Unknown(String),
}

impl std::fmt::Display for StackError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Recursion(name) => write!(f, "{name} can call itself, so its stack has no bound"),
            Self::Dynamic(name) => write!(f, "{name} has a stack frame of unknown size"),
            Self::Unknown(name) => write!(f, "there is no function {name} in the image"),
        }
    }
}

impl std::error::Error for StackError {}

/// Call graph of an image: functions by address, and functions that may be called by pointer.
#[derive(Clone, Debug, Default)]
pub struct Calls {
    functions: BTreeMap<u64, Function>,
    pointed_at: BTreeSet<u64>,
}

impl Calls {
    /// Parses a `disassembly` by `llvm-objdump -d --no-show-raw-insn` into a call graph.
    ///
    /// `constants` are the words of the read-only data. A word equal to a function's address plus 1 is a pointer to
    /// that Thumb function.
    ///
    /// # Errors
    /// [`StackError::Dynamic`] for a function that moves the stack pointer by a register.
    pub fn read(
        disassembly: &str,
        constants: impl Iterator<Item = u32>,
    ) -> Result<Self, StackError> {
        let mut functions: BTreeMap<u64, Function> = BTreeMap::new();
        let mut at = None;
        for line in disassembly.lines() {
            if let Some((address, name)) = heading(line) {
                functions.insert(
                    address,
                    Function {
                        name: name.to_owned(),
                        ..Function::default()
                    },
                );
                at = Some(address);
            } else if let Some(function) = at.and_then(|at| functions.get_mut(&at)) {
                instruction(line, function)?;
            }
        }
        let starts: BTreeSet<u64> = functions.keys().copied().collect();
        for (own, function) in &mut functions {
            // Jumps inside a function are not calls.
            function.calls.retain(|to| to != own && starts.contains(to));
        }
        let pointed_at = constants
            .filter(|word| word & 1 == 1)
            .map(|word| u64::from(word & !1))
            .filter(|address| starts.contains(address))
            .collect();
        Ok(Self {
            functions,
            pointed_at,
        })
    }

    fn address_of(&self, name: &str) -> Result<u64, StackError> {
        let found = self
            .functions
            .iter()
            .find(|(_, function)| function.name == name);
        found
            .map(|(address, _)| *address)
            .ok_or_else(|| StackError::Unknown(name.to_owned()))
    }

    /// Returns the largest stack of the function `name` with its callees, bytes, and the path of calls.
    ///
    /// # Errors
    /// [`StackError`] if the function does not exist or its stack has no bound.
    pub fn deepest(&self, name: &str) -> Result<(u64, Vec<String>), StackError> {
        let mut known = BTreeMap::new();
        let from = self.address_of(name)?;
        let depth = self.depth(from, &mut Vec::new(), &mut known)?;
        let mut path = Vec::new();
        let mut next = Some(from);
        while let Some(at) = next {
            path.push(
                self.functions
                    .get(&at)
                    .map_or_else(String::new, |function| function.name.clone()),
            );
            next = known.get(&at).and_then(|&(_, callee)| callee);
        }
        Ok((depth, path))
    }

    fn depth(
        &self,
        at: u64,
        path: &mut Vec<u64>,
        known: &mut BTreeMap<u64, (u64, Option<u64>)>,
    ) -> Result<u64, StackError> {
        if let Some(&(depth, _)) = known.get(&at) {
            return Ok(depth);
        }
        let Some(function) = self.functions.get(&at) else {
            return Ok(0);
        };
        if path.contains(&at) {
            return Err(StackError::Recursion(function.name.clone()));
        }
        path.push(at);
        let mut deepest = (0, None);
        let through_pointers = self
            .pointed_at
            .iter()
            .filter(|to| function.indirect && **to != at && !path.contains(to));
        let callees: Vec<u64> = function
            .calls
            .iter()
            .chain(through_pointers)
            .copied()
            .collect();
        for callee in callees {
            let depth = self.depth(callee, path, known)?;
            if depth > deepest.0 {
                deepest = (depth, Some(callee));
            }
        }
        path.pop();
        let depth = function.frame + deepest.0;
        known.insert(at, (depth, deepest.1));
        Ok(depth)
    }
}

/// Parses the first line of a function, `08000194 <name>:`, into its address and name.
fn heading(line: &str) -> Option<(u64, &str)> {
    let (address, rest) = line.split_once(" <")?;
    let name = rest.strip_suffix(">:")?;
    Some((u64::from_str_radix(address, 16).ok()?, name))
}

fn instruction(line: &str, function: &mut Function) -> Result<(), StackError> {
    let mut parts = line.split('\t').map(str::trim).skip(1);
    let (Some(mnemonic), operands) = (parts.next(), parts.next().unwrap_or("")) else {
        return Ok(());
    };
    let base = mnemonic.split('.').next().unwrap_or(mnemonic);
    match base {
        "push" => function.frame += 4 * registers(operands),
        "vpush" => {
            let width = if operands.contains('s') { 4 } else { 8 };
            function.frame += width * registers(operands);
        }
        "stmdb" | "stm" if operands.starts_with("sp!") => function.frame += 4 * registers(operands),
        "sub" | "subw" if operands.starts_with("sp,") => {
            let size =
                immediate(operands).ok_or_else(|| StackError::Dynamic(function.name.clone()))?;
            function.frame += size;
        }
        "str" | "strd" if operands.contains("[sp, #-") && operands.contains("]!") => {
            function.frame += immediate(operands).unwrap_or(8);
        }
        "blx" if operands.starts_with(['r', 'l']) => function.indirect = true,
        _ if base.starts_with('b') => function.calls.extend(target(operands)),
        _ => {}
    }
    Ok(())
}

/// Returns the number of registers in a list such as `{r4, r5, lr}`, which has no ranges.
fn registers(operands: &str) -> u64 {
    let list = operands.split_once('{').map_or("", |(_, list)| list);
    list.split(',').count() as u64
}

/// Parses the number after `#` or `#-` in operands, decimal or hexadecimal; the sign is ignored.
fn immediate(operands: &str) -> Option<u64> {
    let (_, text) = operands.split_once('#')?;
    let text = text.trim_start_matches('-');
    let text: String = text
        .chars()
        .take_while(char::is_ascii_alphanumeric)
        .collect();
    match text.strip_prefix("0x") {
        Some(hexadecimal) => u64::from_str_radix(hexadecimal, 16).ok(),
        None => text.parse().ok(),
    }
}

/// Parses the address in operands such as `0x8000194 <name> @ imm = #0x10`.
fn target(operands: &str) -> Option<u64> {
    let word = operands
        .split([' ', ','])
        .find_map(|word| word.strip_prefix("0x"))?;
    u64::from_str_radix(word, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::{Calls, StackError};

    const IMAGE: &str = "
08000100 <main>:
 8000100:      \tpush\t{r4, r5, r7, lr}
 8000102:      \tsub\tsp, #0x10
 8000104:      \tbl\t0x8000200 <left> @ imm = #0x10
 8000108:      \tbl\t0x8000300 <right> @ imm = #0x10
 800010c:      \tb\t0x8000104 <main+0x4> @ imm = #-0x10

08000200 <left>:
 8000200:      \tpush.w\t{r4, r5, r6, r7, r8, lr}
 8000204:      \tvpush\t{d8, d9}
 8000208:      \tbx\tlr

08000300 <right>:
 8000300:      \tstr\tr11, [sp, #-4]!
 8000304:      \tblx\tr6
 8000308:      \tb.w\t0x8000200 <left> @ imm = #-0x10

08000400 <pointed>:
 8000400:      \tsub.w\tsp, sp, #0x100
";

    #[test]
    fn the_deepest_path_is_found_through_jumps_and_pointers() {
        let none = Calls::read(IMAGE, std::iter::empty()).unwrap();
        assert_eq!(none.deepest("left").unwrap().0, 24 + 16);
        assert_eq!(
            none.deepest("main").unwrap(),
            (
                32 + 4 + 40,
                vec!["main".into(), "right".into(), "left".into()]
            )
        );
        let pointed = Calls::read(IMAGE, [0x0800_0401, 0x0800_0200, 7].into_iter()).unwrap();
        assert_eq!(pointed.deepest("main").unwrap().0, 32 + 4 + 256);
    }

    #[test]
    fn a_call_without_a_bound_is_an_error() {
        let round = IMAGE.replace("bx\tlr", "bl\t0x8000300 <right> @ imm = #0x10");
        let calls = Calls::read(&round, std::iter::empty()).unwrap();
        assert!(matches!(
            calls.deepest("main"),
            Err(StackError::Recursion(_))
        ));
        let dynamic = IMAGE.replace("sub\tsp, #0x10", "sub.w\tsp, sp, r3");
        assert_eq!(
            Calls::read(&dynamic, std::iter::empty()).unwrap_err(),
            StackError::Dynamic("main".into())
        );
        let unknown = Calls::read(IMAGE, std::iter::empty())
            .unwrap()
            .deepest("nobody");
        assert_eq!(unknown.unwrap_err(), StackError::Unknown("nobody".into()));
    }
}
