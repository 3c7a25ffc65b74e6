//! Runs programs, and passes their output on.

use anyhow::{Context, Result, bail};
use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// The workspace's root.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_path_buf).unwrap_or_default()
}

/// A program to run in the root.
pub(crate) struct Program(Command);

pub(crate) fn program(name: impl AsRef<OsStr>) -> Program {
    let mut command = Command::new(name);
    command.current_dir(root());
    Program(command)
}

/// The cargo that runs this.
pub(crate) fn cargo<const N: usize>(args: [&str; N]) -> Program {
    program(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())).args(args)
}

/// Starts this program anew where it would compile incrementally, if nobody has asked for that. A single compilation, of a
/// tree that is new, would take a minute more.
pub(crate) fn without_incremental() -> Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt as _;
        const KEY: &str = "CARGO_INCREMENTAL";
        if std::env::var_os(KEY).is_none() {
            let mut again = Command::new(std::env::current_exe()?);
            return Err(again.args(std::env::args_os().skip(1)).env(KEY, "0").exec().into());
        }
    }
    Ok(())
}

/// A verb of this program that runs in the background, its output unseen until the end. It gives way to what else runs:
/// some tests are of a loop in real time, and no machine has to let them have its priority.
pub(crate) fn beside(verb: &str, options: &[&str]) -> Result<Beside> {
    let path = root().join("target").join(format!("{verb}.log"));
    let log = std::fs::File::create(&path).with_context(|| path.display().to_string())?;
    let mut verb = program(std::env::current_exe()?).arg(verb).args(options).giving_way();
    verb.announce();
    let child = verb.0.stdout(log.try_clone()?).stderr(log).spawn()?;
    Ok(Beside { child, path })
}

/// A program in the background.
pub(crate) struct Beside {
    child: Child,
    path: PathBuf,
}

impl Beside {
    /// Waits for its end; its success, and its output on both streams.
    pub(crate) fn output(mut self) -> Result<(bool, String)> {
        let done = self.child.wait()?;
        let text = std::fs::read(&self.path).with_context(|| self.path.display().to_string())?;
        Ok((done.success(), String::from_utf8_lossy(&text).into_owned()))
    }
}

impl Program {
    pub(crate) fn arg(mut self, arg: impl AsRef<OsStr>) -> Self {
        self.0.arg(arg);
        self
    }

    pub(crate) fn args<S: AsRef<OsStr>>(mut self, args: impl IntoIterator<Item = S>) -> Self {
        self.0.args(args);
        self
    }

    pub(crate) fn within(mut self, folder: &Path) -> Self {
        self.0.current_dir(folder);
        self
    }

    pub(crate) fn env(mut self, key: &str, value: impl AsRef<OsStr>) -> Self {
        self.0.env(key, value);
        self
    }

    /// The same program, with less priority than what runs beside it.
    pub(crate) fn giving_way(self) -> Self {
        if !cfg!(unix) {
            return self;
        }
        let mut nice = program("nice").args(["-n", "10"]).arg(self.0.get_program()).args(self.0.get_args());
        nice.0.current_dir(self.0.get_current_dir().unwrap_or(&root()));
        for (key, value) in self.0.get_envs() {
            match value {
                Some(value) => nice.0.env(key, value),
                None => nice.0.env_remove(key),
            };
        }
        nice
    }

    /// Removes a variable, whatever this process has set.
    pub(crate) fn without(mut self, key: &str) -> Self {
        self.0.env_remove(key);
        self
    }

    fn shown(&self) -> String {
        let words = std::iter::once(self.0.get_program()).chain(self.0.get_args());
        words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
    }

    fn announce(&self) -> String {
        let shown = self.shown();
        println!("\n$ {shown}");
        shown
    }

    /// Runs it; an error if it fails.
    pub(crate) fn run(mut self) -> Result<()> {
        let shown = self.announce();
        let status = self.0.status().with_context(|| format!("cannot start: {shown}"))?;
        if !status.success() {
            bail!("failed ({status}): {shown}");
        }
        Ok(())
    }

    /// Runs it, hands each line of its output to `line`; true if it succeeded.
    pub(crate) fn lines(mut self, mut line: impl FnMut(&str)) -> Result<bool> {
        let shown = self.announce();
        let mut child =
            self.0.stdout(Stdio::piped()).spawn().with_context(|| format!("cannot start: {shown}"))?;
        if let Some(out) = child.stdout.take() {
            for text in BufReader::new(out).lines() {
                let text = text?;
                println!("{text}");
                line(&text);
            }
        }
        Ok(child.wait()?.success())
    }

    /// Runs it unseen; gives its success, and its output on both streams.
    pub(crate) fn quietly(self) -> Result<(bool, String)> {
        self.announce();
        self.silently()
    }

    /// Runs it unseen; gives its standard output, an error with both streams if it fails.
    pub(crate) fn output(mut self) -> Result<Vec<u8>> {
        let shown = self.shown();
        let output = self.0.output().with_context(|| format!("cannot start: {shown}"))?;
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
            bail!("failed ({}): {shown}\n{text}", output.status);
        }
        Ok(output.stdout)
    }

    /// As [`Program::quietly`], without a word of it.
    pub(crate) fn silently(mut self) -> Result<(bool, String)> {
        let shown = self.shown();
        let output = self.0.output().with_context(|| format!("cannot start: {shown}"))?;
        let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        Ok((output.status.success(), text.into_owned()))
    }
}
