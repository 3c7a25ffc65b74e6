//! A run in a terminal: the screen, and its keys.

use crate::figures::Figures;
use crate::view::View;
use crate::view::{Frame, Note, Opening};
use clutch_log::Header;
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::crossterm::terminal::{
    Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::crossterm::{cursor, execute};
use std::io::{self, BufWriter, IsTerminal, Stderr};
use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, Instant};

/// Time between two pictures.
const PICTURE: Duration = Duration::from_millis(66);

/// True while the terminal shows the screen: there is one terminal.
static SHOWN: AtomicBool = AtomicBool::new(false);

/// A screen on the terminal of standard error, while runs go on.
#[derive(Debug)]
pub(crate) struct Scope {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    figures: Mutex<Figures>,
    stop: Arc<AtomicBool>,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    /// True while there is a thread that draws.
    drawing: bool,
    /// True if nothing more comes.
    closed: bool,
}

impl Scope {
    /// A screen whose keys set `stop`.
    ///
    /// # Errors
    /// There is no terminal, or none that a screen can be drawn on.
    pub(crate) fn new(stop: Arc<AtomicBool>) -> io::Result<Scope> {
        let none = |what: &str| Err(io::Error::new(io::ErrorKind::Unsupported, what.to_owned()));
        if !io::stderr().is_terminal() {
            return none("standard error, on which the scope is drawn, is no terminal");
        }
        if !io::stdin().is_terminal() {
            return none("standard input, from which the scope has its keys, is no terminal");
        }
        if std::env::var_os("TERM").is_none_or(|term| term.is_empty() || term == "dumb") {
            return none("TERM names no terminal that a scope can be drawn on");
        }
        let colour = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
        let (figures, state) = (Mutex::new(Figures::new(colour)), Mutex::default());
        Ok(Scope { inner: Arc::new(Inner { figures, stop, state, changed: Condvar::new() }) })
    }
}

impl View for Scope {
    fn begin(&self, _: &Header, run: &Opening<'_>) {
        self.inner.figures().begin(run);
        let mut state = self.inner.state();
        if state.drawing {
            return;
        }
        let inner = self.inner.clone();
        let draw = move || {
            // A terminal that has gone away does not stop a run.
            let _ = inner.draw();
            inner.state().drawing = false;
            inner.changed.notify_all();
        };
        state.drawing = std::thread::Builder::new().name("clutch-scope".into()).spawn(draw).is_ok();
    }

    fn note(&self, note: &Note) {
        self.inner.figures().note(note);
    }

    fn frame(&self, frame: &Frame) {
        self.inner.figures().frame(frame);
    }

    /// The one in front of the terminal.
    fn readers(&self) -> usize {
        1
    }

    fn close(&self, at_most: Duration) {
        let mut state = self.inner.state();
        state.closed = true;
        self.inner.changed.notify_all();
        let until = Instant::now() + at_most;
        while state.drawing {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            state = self.inner.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Inner {
    fn figures(&self) -> MutexGuard<'_, Figures> {
        self.figures.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Draws until nothing more comes.
    fn draw(&self) -> io::Result<()> {
        let _screen = Screen::enter()?;
        let mut terminal = Terminal::new(CrosstermBackend::new(BufWriter::new(io::stderr())))?;
        while !self.state().closed && SHOWN.load(Ordering::Relaxed) {
            // The figures are free again before anything goes to the terminal, which may be slow.
            terminal.draw(|frame| self.figures().render(frame))?;
            if event::poll(PICTURE)? && is_stop(&event::read()?) {
                self.stop.store(true, Ordering::Relaxed);
            }
        }
        Ok(())
    }
}

/// True for the keys that end a run. Ctrl-C is one of them: here it is a key and no signal.
fn is_stop(event: &Event) -> bool {
    let Event::Key(KeyEvent { code, modifiers, kind: KeyEventKind::Press, .. }) = event else { return false };
    match code {
        KeyCode::Esc | KeyCode::Char('q' | 'Q') => true,
        KeyCode::Char('c') => modifiers.contains(KeyModifiers::CONTROL),
        _ => false,
    }
}

/// The terminal as the screen has it: each way out leaves it as it was.
struct Screen;

impl Screen {
    fn enter() -> io::Result<Screen> {
        static HOOK: Once = Once::new();
        HOOK.call_once(|| {
            let before = panic::take_hook();
            // A panic is reported where it can be read.
            panic::set_hook(Box::new(move |panic| {
                leave();
                before(panic);
            }));
        });
        SHOWN.store(true, Ordering::Relaxed);
        let screen = Screen;
        enable_raw_mode()?;
        // A terminal without a second screen still shows what was there.
        execute!(io::stderr(), EnterAlternateScreen, Clear(ClearType::All), cursor::Hide)?;
        Ok(screen)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        leave();
    }
}

fn leave() {
    if SHOWN.swap(false, Ordering::Relaxed) {
        let mut terminal: Stderr = io::stderr();
        // There is nobody who could be told.
        let _ = disable_raw_mode();
        let _ = execute!(terminal, LeaveAlternateScreen, cursor::Show);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn q_escape_and_control_c_end_a_run_and_nothing_else_does() {
        let key = |code, modifiers| Event::Key(KeyEvent::new(code, modifiers));
        let control = KeyModifiers::CONTROL;
        for (code, modifiers) in [
            (KeyCode::Char('q'), KeyModifiers::NONE),
            (KeyCode::Char('Q'), KeyModifiers::SHIFT),
            (KeyCode::Esc, KeyModifiers::NONE),
            (KeyCode::Char('c'), control),
        ] {
            assert!(is_stop(&key(code, modifiers)), "{code:?}");
        }
        for (code, modifiers) in [
            (KeyCode::Char('c'), KeyModifiers::NONE),
            (KeyCode::Up, KeyModifiers::NONE),
            (KeyCode::Char('x'), control),
        ] {
            assert!(!is_stop(&key(code, modifiers)), "{code:?}");
        }
        assert!(!is_stop(&Event::Resize(80, 24)));
    }

    #[test]
    fn without_a_terminal_there_is_no_scope() {
        // The standard streams of a test may be a terminal: then there is nothing to see here.
        if !io::stderr().is_terminal() {
            let refusal = Scope::new(Arc::default()).unwrap_err().to_string();
            assert!(refusal.contains("is no terminal"), "{refusal}");
        }
    }
}
