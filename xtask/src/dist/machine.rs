//! Machines on which what was built runs: this one, and emulators of others.

use super::work;
use crate::run::{Program, program};
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Scenarios whose results are compared: a brake and a motor, each law of the paper, one with memory, single precision.
const SCENARIOS: [&str; 6] = ["pd_2", "ctc_2", "smc_2", "f32_smc_2", "bench_glide_2", "motor_pid"];

/// A machine.
pub(super) struct Machine {
    pub(super) name: &'static str,
    /// The program that runs another's, with arguments; nothing on this one.
    emulator: Vec<OsString>,
    settings: Vec<(&'static str, OsString)>,
}

impl Machine {
    /// This one.
    pub(super) fn here() -> Machine {
        Machine { name: "this machine", emulator: Vec::new(), settings: Vec::new() }
    }

    /// Linux on a 64-bit Arm processor; with libraries from a folder, if one is given.
    pub(super) fn arm64(libraries: Option<&Path>) -> Machine {
        let mut emulator = vec!["qemu-aarch64".into()];
        if let Some(folder) = libraries {
            emulator.extend(["-L".into(), folder.into()]);
        }
        Machine { name: "aarch64 (qemu)", emulator, settings: Vec::new() }
    }

    /// Windows. Wine before 9 lacks a library that each Rust program wants: here is one.
    pub(super) fn windows() -> Result<Machine> {
        let folder = work("windows")?;
        let (source, library) = (folder.join("random.c"), folder.join("bcryptprimitives.dll"));
        std::fs::write(&source, include_str!("random.c"))?;
        let compile = program("x86_64-w64-mingw32-gcc").args(["-shared", "-Wall", "-Werror", "-o"]);
        compile.arg(library).arg(source).arg("-ladvapi32").run()?;
        let settings = vec![
            ("WINEPREFIX", folder.join("wine").into()),
            ("WINEPATH", folder.clone().into()),
            ("WINEDEBUG", "-all".into()),
            // It would ask whether to fetch .NET and a browser.
            ("WINEDLLOVERRIDES", "mscoree,mshtml=".into()),
        ];
        let machine = Machine { name: "Windows (wine)", emulator: vec!["wine".into()], settings };
        machine.program("wineboot".as_ref()).args(["--init"]).quietly()?;
        Ok(machine)
    }

    /// The same with a setting more.
    pub(super) fn with(mut self, key: &'static str, value: OsString) -> Machine {
        self.settings.push((key, value));
        self
    }

    /// A program on it.
    pub(super) fn program(&self, file: &Path) -> Program {
        let mut words = self.emulator.iter().map(OsString::as_os_str).chain([file.as_os_str()]);
        let first = words.next().unwrap_or_default();
        self.settings.iter().fold(program(first).args(words), |p, (key, value)| p.env(key, value))
    }

    /// Everything that the command computes of these scenarios and of the paper, by name.
    pub(super) fn results(&self, command: &[&Path], name: &str) -> Result<Results> {
        let folder = work(name)?;
        let (first, rest) = command.split_first().context("a command")?;
        let run = |args: &[&str]| self.program(first).args(rest).within(&folder).args(args).output();
        let begin = Instant::now();
        let mut files = BTreeMap::new();
        for scenario in SCENARIOS {
            files.insert(scenario.to_owned(), run(&["sim", scenario, "--json"])?);
        }
        run(&["reproduce", "--out", "paper"])?;
        for entry in std::fs::read_dir(folder.join("paper"))? {
            let path = entry?.path();
            files.insert(super::name(&path), std::fs::read(&path)?);
        }
        Ok(Results { machine: self.name, files, seconds: begin.elapsed().as_secs_f64() })
    }
}

/// Results of a command on a machine.
pub(super) struct Results {
    machine: &'static str,
    files: BTreeMap<String, Vec<u8>>,
    seconds: f64,
}

impl Results {
    /// A line of the summary, where they are these byte for byte; an error that names what differs.
    pub(super) fn same_as(&self, reference: &Results) -> Result<String> {
        let names: Vec<&String> = reference.files.keys().chain(self.files.keys()).collect();
        let differing: Vec<&&String> =
            names.iter().filter(|name| self.files.get(**name) != reference.files.get(**name)).collect();
        ensure!(
            differing.is_empty(),
            "{} and {} give different bytes: {differing:?}",
            self.machine,
            reference.machine
        );
        let Results { machine, files, seconds } = self;
        let (scenarios, paper) = (SCENARIOS.len(), files.len() - SCENARIOS.len());
        Ok(format!(
            "on {machine}: sim of {scenarios} scenarios and the {paper} files of reproduce have the bytes of {}; \
             {seconds:.0} s",
            reference.machine
        ))
    }

    /// In a line of the summary.
    pub(super) fn told(&self) -> String {
        let paper = self.files.len() - SCENARIOS.len();
        format!(
            "on {}: sim of {} scenarios, reproduce gives {paper} files; {:.0} s",
            self.machine,
            SCENARIOS.len(),
            self.seconds
        )
    }
}

/// A Python for a 64-bit Arm processor, of Debian's packages, unpacked and not installed; gives the folder.
pub(super) fn python_arm64() -> Result<PathBuf> {
    let folder = work("arm64")?;
    let (state, root) = (folder.join("state"), folder.join("root"));
    let cache = folder.join("cache/archives");
    for made in [&state.join("lists/partial"), &cache.join("partial"), &root] {
        std::fs::create_dir_all(made)?;
    }
    std::fs::write(state.join("status"), "")?;
    let apt = || {
        let option = |key: &str, value: &Path| format!("{key}={}", value.display());
        let places = [option("Dir::State", &state), option("Dir::State::status", &state.join("status"))];
        let processor = ["APT::Architecture=arm64", "APT::Architectures=arm64"].map(str::to_owned);
        // Everybody may read it, and no one else's files are written: root does not change into another.
        let others = [option("Dir::Cache", &folder.join("cache")), "APT::Sandbox::User=root".to_owned()];
        let options = places.into_iter().chain(processor).chain(others).flat_map(|o| ["-o".to_owned(), o]);
        program("apt-get").arg("-q").args(options)
    };
    apt().arg("update").run()?;
    apt().args(["install", "--download-only", "--yes", "--no-install-recommends", "python3"]).run()?;
    for entry in std::fs::read_dir(&cache)? {
        let path = entry?.path();
        if path.extension().is_some_and(|ending| ending == "deb") {
            program("dpkg").arg("-x").arg(&path).arg(&root).silently()?;
        }
    }
    Ok(root)
}

/// A Python for Windows, of the packages for Java: address, and sum.
const PYTHON_WINDOWS: (&str, &str) = (
    "https://repo1.maven.org/maven2/org/bytedeco/cpython/3.11.3-1.5.9/cpython-3.11.3-1.5.9-windows-x86_64.jar",
    "3263a50b256447bb7b9e604d6587627e419891370fc33b94469e6a06ff4de834",
);

/// Its version.
pub(super) const PYTHON_WINDOWS_VERSION: &str = "3.11";

/// A Python for Windows, fetched and unpacked; gives its interpreter. It has no python3.dll, by which modules for each
/// version ask for the library of one: here is that of `module`.
pub(super) fn python_windows(module: &Path) -> Result<PathBuf> {
    let folder = work("python-windows")?;
    let (address, sum) = PYTHON_WINDOWS;
    program("curl").args(["-sSf", "-L", "-o", "python.jar", address]).within(&folder).run()?;
    std::fs::write(folder.join("python.sum"), format!("{sum}  python.jar\n"))?;
    program("sha256sum").args(["--check", "--quiet", "python.sum"]).within(&folder).run()?;
    program("python3").args(["-m", "zipfile", "-e", "python.jar", "."]).within(&folder).run()?;
    let home = folder.join("org/bytedeco/cpython/windows-x86_64");

    let imports = program("x86_64-w64-mingw32-objdump").arg("-p").arg(module).output()?;
    let imports = String::from_utf8_lossy(&imports);
    let library = PYTHON_WINDOWS_VERSION.replace('.', "");
    let mut definition = "LIBRARY python3\nEXPORTS\n".to_owned();
    let mut of_python = false;
    for line in imports.lines() {
        if let Some((_, name)) = line.split_once("DLL Name: ") {
            of_python = name == "python3.dll";
        }
        let name =
            line.split_whitespace().nth(2).filter(|name| name.trim_start_matches('_').starts_with("Py"));
        if let Some(name) = name.filter(|_| of_python) {
            definition += &format!("{name} = python{library}.{name}\n");
        }
    }
    std::fs::write(folder.join("python3.def"), definition)?;
    let link = program("x86_64-w64-mingw32-gcc").args(["-shared", "-nostdlib", "-Wl,-e,0", "-o"]);
    link.arg(home.join("python3.dll")).arg("python3.def").within(&folder).run()?;
    Ok(home.join("python.exe"))
}
