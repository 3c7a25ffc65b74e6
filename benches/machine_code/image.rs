//! A linked image: its functions, their code, its sections.

use super::Fault;
use super::constant;
use super::decode::{Decoder, Instruction};
use addr2line::Loader;
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

/// A function of the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its name as written in the source, without a hash.
    pub name: String,
    /// Address of its first instruction.
    pub address: u32,
    /// Bytes of code and of the constants within.
    pub size: u32,
}

/// A section of the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    /// Name, `.text` for one.
    pub name: String,
    /// Its address when the image runs.
    pub address: u32,
    /// Bytes.
    pub size: u32,
    /// True if bytes for it are flashed.
    pub stored: bool,
}

/// A linked image.
pub struct Image {
    functions: BTreeMap<u32, Function>,
    /// Code by section: address and bytes.
    code: Vec<(u32, Vec<u8>)>,
    /// Starts of code and of constants: the linker's `$t` and `$d`.
    marks: BTreeMap<u32, bool>,
    sections: Vec<Section>,
    symbols: Vec<String>,
    /// The words of the table of exceptions, but for the stack pointer.
    vectors: Vec<u32>,
    lines: Option<Loader>,
    decoder: Decoder,
    /// Instructions by the function's address, of those that were asked for: many bounds ask for the same.
    decoded: RefCell<BTreeMap<u32, Rc<[Instruction]>>>,
}

impl Image {
    /// Reads the ELF file at `path`.
    ///
    /// # Errors
    /// Not a file, or not an ELF image for a Cortex-M.
    pub fn read(path: &Path) -> Result<Image, Fault> {
        let told = |e: &dyn std::fmt::Display| Fault::Image(format!("{}: {e}", path.display()));
        let bytes = std::fs::read(path).map_err(|e| told(&e))?;
        let lines = Loader::new(path).map_err(|e| told(&e))?;
        let mut image = Image::parse(&bytes).map_err(|e| told(&e))?;
        image.lines = Some(lines);
        Ok(image)
    }

    fn parse(bytes: &[u8]) -> Result<Image, object::Error> {
        let file = object::File::parse(bytes)?;
        let mut image = Image::of_code(0, Vec::new(), &[]);
        for section in file.sections() {
            let (name, address, size) = (section.name()?, section.address() as u32, section.size() as u32);
            if section.kind() == SectionKind::Text {
                image.code.push((address, section.data()?.to_vec()));
            }
            if name == ".vector_table" {
                let words = section.data()?.as_chunks::<4>().0.iter().map(|w| u32::from_le_bytes(*w));
                image.vectors = words.skip(1).collect();
            }
            let loaded = matches!(
                section.kind(),
                SectionKind::Text
                    | SectionKind::Data
                    | SectionKind::ReadOnlyData
                    | SectionKind::ReadOnlyString
                    | SectionKind::UninitializedData
            );
            if loaded && size > 0 {
                let stored = section.kind() != SectionKind::UninitializedData;
                image.sections.push(Section { name: name.to_owned(), address, size, stored });
            }
        }
        for symbol in file.symbols() {
            let (name, address) = (symbol.name()?, symbol.address() as u32);
            match name.get(..2) {
                Some("$t") => drop(image.marks.insert(address, true)),
                Some("$d") => drop(image.marks.insert(address, false)),
                _ => {}
            }
            if symbol.is_definition() {
                image.symbols.push(name.to_owned());
            }
            if symbol.kind() == SymbolKind::Text && symbol.size() > 0 {
                let name = plain(name);
                let function = Function { name, address: address & !1, size: symbol.size() as u32 };
                // If one place has several names, the one that sorts first.
                image
                    .functions
                    .entry(function.address)
                    .and_modify(|f| {
                        if function.name < f.name {
                            f.name.clone_from(&function.name);
                        }
                        f.size = f.size.max(function.size);
                    })
                    .or_insert(function);
            }
        }
        Ok(image)
    }

    /// An image of code that is given byte by byte: name, offset and size of each function.
    #[must_use]
    pub fn of_code(address: u32, code: Vec<u8>, functions: &[(&str, u32, u32)]) -> Image {
        let functions = functions
            .iter()
            .map(|(name, offset, size)| Function {
                name: (*name).to_owned(),
                address: address + offset,
                size: *size,
            })
            .map(|f| (f.address, f));
        Image {
            functions: functions.collect(),
            code: vec![(address, code)],
            marks: BTreeMap::new(),
            sections: Vec::new(),
            symbols: Vec::new(),
            vectors: Vec::new(),
            lines: None,
            decoder: Decoder::new(),
            decoded: RefCell::default(),
        }
    }

    /// All functions.
    pub fn functions(&self) -> impl Iterator<Item = &Function> {
        self.functions.values()
    }

    /// The function of this name.
    ///
    /// # Errors
    /// There is none.
    pub fn function(&self, name: &str) -> Result<&Function, Fault> {
        self.functions.values().find(|f| f.name == name).ok_or_else(|| Fault::NoFunction(name.to_owned()))
    }

    /// The functions that exceptions and interrupts begin with; the first is that of the reset.
    pub fn handlers(&self) -> impl Iterator<Item = &Function> {
        self.vectors.iter().filter_map(|v| self.functions.get(&(v & !1)))
    }

    /// The function that begins at an address.
    #[must_use]
    pub fn function_at(&self, address: u32) -> Option<&Function> {
        self.functions.get(&address)
    }

    /// Sections that are there when the image runs.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Symbols for arithmetic in double precision: compiler-rt's and the EABI's names.
    #[must_use]
    pub fn double_precision(&self) -> Vec<&str> {
        let is_double = |name: &str| {
            let eabi = name.strip_prefix("__aeabi_");
            let helper = eabi.is_some_and(|n| {
                matches!(n, "cdcmple" | "cdcmpeq" | "cdrcmple")
                    || n.strip_prefix('d').is_some_and(|n| {
                        ["add", "sub", "mul", "div", "cmp", "rsub", "neg", "2"]
                            .iter()
                            .any(|x| n.starts_with(x))
                    })
                    || n.ends_with("2d")
            });
            let libgcc = name.starts_with("__")
                && (name.contains("df") || name.ends_with("df2"))
                && [
                    "add", "sub", "mul", "div", "neg", "float", "fix", "extend", "trunc", "cmp", "eq", "ne",
                    "lt", "le", "gt", "ge", "unord", "pow",
                ]
                .iter()
                .any(|x| name[2..].starts_with(x));
            helper || libgcc
        };
        self.symbols.iter().map(String::as_str).filter(|s| is_double(s)).collect()
    }

    /// The functions that an address was inlined from, innermost first.
    #[must_use]
    pub fn inlined_from(&self, address: u32) -> Vec<String> {
        let mut names = Vec::new();
        let Some(mut frames) = self.lines.as_ref().and_then(|l| l.find_frames(u64::from(address)).ok())
        else {
            return names;
        };
        while let Ok(Some(frame)) = frames.next() {
            let name = frame.function.as_ref().and_then(|f| f.raw_name().ok().map(|n| plain(&n)));
            names.extend(name);
        }
        names
    }

    /// The instructions of a function.
    ///
    /// # Errors
    /// Bytes that are not an instruction.
    pub(super) fn instructions(&self, function: &Function) -> Result<Rc<[Instruction]>, Fault> {
        if let Some(known) = self.decoded.borrow().get(&function.address) {
            return Ok(known.clone());
        }
        let all: Rc<[Instruction]> = self.decoded(function)?.into();
        self.decoded.borrow_mut().insert(function.address, all.clone());
        Ok(all)
    }

    fn decoded(&self, function: &Function) -> Result<Vec<Instruction>, Fault> {
        let end = function.address + function.size;
        // Constants between the instructions are left out.
        let mut from = (function.address, self.is_code(function.address));
        let inside = self.marks.range(function.address + 1..end).map(|(a, code)| (*a, *code));
        let mut all = Vec::new();
        for (next, code) in inside.chain([(end, true)]) {
            if from.1 {
                let bytes = self.bytes(from.0, next).unwrap_or_default();
                let part = self.decoder.decode(bytes, from.0);
                let ended = part.last().map_or(from.0, |i| i.address + i.size);
                if ended != next {
                    return Err(Fault::Undecodable { function: function.name.clone(), address: ended });
                }
                all.extend(part);
            }
            from = (next, code);
        }
        constant::resolve(&mut all, |address| self.word(address));
        Ok(all)
    }

    /// The constant at an address between instructions.
    pub(super) fn word(&self, address: u32) -> Option<u32> {
        let bytes = self.bytes(address, address.checked_add(4)?)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    }

    fn is_code(&self, address: u32) -> bool {
        self.marks.range(..=address).next_back().is_none_or(|(_, code)| *code)
    }

    fn bytes(&self, from: u32, to: u32) -> Option<&[u8]> {
        self.code.iter().find_map(|(start, bytes)| {
            let first = from.checked_sub(*start)?;
            bytes.get(first as usize..(to - start) as usize)
        })
    }
}

/// A name as in the source.
fn plain(name: &str) -> String {
    format!("{:#}", addr2line::demangle_auto(name.into(), None))
}
