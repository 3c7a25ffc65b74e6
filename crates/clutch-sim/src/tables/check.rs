//! Relations between parameters of one table, with the path of the table.

use clutch_core::ParamError;
use clutch_core::params::{Choice, Editor, Params, Table as Parameters};

/// The first table at or below the key `within` whose parameters do not fit each other: its path, and the error.
/// Nothing is changed: an editor is what walks over parameters.
pub(crate) fn check<P: Params<f64>>(params: &mut P, within: &str) -> Option<(String, ParamError)> {
    let mut checks = Checks { path: Vec::new(), within, found: None };
    params.edit(&mut checks);
    checks.found
}

struct Checks<'a> {
    path: Vec<&'static str>,
    within: &'a str,
    found: Option<(String, ParamError)>,
}

impl Checks<'_> {
    fn inside(&self) -> bool {
        if self.within.is_empty() {
            return true;
        }
        let path = self.path.join(".");
        path.strip_prefix(self.within).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    }
}

impl Editor<f64> for Checks<'_> {
    fn real<P: Parameters<f64>>(&mut self, _: usize, _: &mut f64) {}
    fn whole<P: Parameters<f64>>(&mut self, _: usize, _: &mut u64) {}
    fn switch<P: Parameters<f64>>(&mut self, _: usize, _: &mut bool) {}
    fn word<P: Parameters<f64>>(&mut self, _: usize, _: &mut usize) {}
    fn enter<P: Parameters<f64>>(&mut self, nested: usize, present: bool) -> bool {
        self.path.push(P::TABLE.nested[nested].key);
        present
    }
    fn leave<P: Parameters<f64>>(&mut self, _: usize) {
        self.path.pop();
    }
    fn choose<C: Choice<f64>>(&mut self, chosen: usize) -> usize {
        self.path.push(C::CHOICE.options[chosen].key);
        chosen
    }
    fn chose<C: Choice<f64>>(&mut self, _: usize) {
        self.path.pop();
    }
    fn table<P: Parameters<f64>>(&mut self, table: &P) {
        if self.found.is_none()
            && self.inside()
            && let Err(e) = table.check_rows()
        {
            self.found = Some((self.path.join("."), e));
        }
    }
}
