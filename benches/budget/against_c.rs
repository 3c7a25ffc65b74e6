//! Our laws and servo beside those in C.

use super::emulator::{Counts, Measured};
use super::plan::{Item, Limit, Plan};
use super::told;
use anyhow::{Context, Result, bail};
use clutch_benches::machine_code::{Bounds, Cost, Image};
use std::collections::BTreeMap;

/// Figures of the functions of the image that measures.
pub(crate) struct Compared<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) image: &'a Image,
    /// Figures of each item.
    pub(crate) bounds: &'a [Cost],
    pub(crate) measured: &'a Measured,
    /// Along the costliest path that was executed.
    pub(crate) cycles: &'a BTreeMap<String, Cost>,
}

impl Compared<'_> {
    fn along(&self, name: &str) -> String {
        self.cycles.get(name).map_or("–".to_owned(), |c| c.cycles.to_string())
    }

    fn counts(&self, name: &str) -> Result<Counts> {
        let counts = self.measured.counts.get(name);
        counts.copied().with_context(|| format!("{name}: the image did not measure it"))
    }

    /// The item of that name, its bound, and that of the function in C.
    fn beside(&self, name: &str, symbol: &str) -> Result<(&Item, Cost, Cost)> {
        let Some((item, ours)) = self.plan.items.iter().zip(self.bounds).find(|(i, _)| i.name == name) else {
            bail!("{name}: in C, without one of ours");
        };
        let facts = self.plan.facts();
        let theirs = Bounds::new(self.image, &facts, &Default::default()).of(symbol).map_err(told)?;
        Ok((item, *ours, theirs))
    }

    /// Prints the comparison of the laws.
    pub(crate) fn laws(&self) -> Result<()> {
        println!(
            "\nThe laws against C (`benches/peer_c`, gcc -O2), executed instructions (least / mean / most; ratios of mean \
             and most) and cycles:\n"
        );
        println!(
            "| law | ours | C | ratios | earlier C | ratios | bound: ours | C | earlier C | measured: ours | C |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|");
        for peer in &self.plan.peers {
            let (item, ours, theirs) = self.beside(&peer.name, &peer.symbol)?;
            let (a, b) = (self.counts(&item.measured)?, self.counts(&peer.symbol)?);
            let ratios = |mean: u64, most: u64| {
                format!("{:.2}, {:.2}", a.mean as f64 / mean as f64, a.most as f64 / most as f64)
            };
            let old = |f: &dyn Fn(Limit) -> String| peer.historic.map_or("–".to_owned(), f);
            println!(
                "| {} | {a} | {b} | {} | {} | {} | {} | {} | {} | {} | {} |",
                peer.name,
                ratios(b.mean, b.most),
                old(&|h| h.instructions.to_string()),
                old(&|h| ratios(h.instructions, h.instructions)),
                ours.cycles,
                theirs.cycles,
                old(&|h| h.cycles.to_string()),
                self.along(&item.measured),
                self.along(&peer.symbol),
            );
        }
        Ok(())
    }

    /// Prints the comparison of the servo.
    pub(crate) fn servos(&self) -> Result<()> {
        println!(
            "\nThe servo against C (`benches/peer_c`, gcc -O2), counts to code: executed instructions (least / mean / \
             most) and cycles; of ours, with the law chosen by settings (any) and at the build (own):\n"
        );
        println!(
            "| servo | any | own | C | ratio of means: any | own | bound: own | C | measured: own | C |\n\
             |---|---|---|---|---|---|---|---|---|---|"
        );
        for peer in &self.plan.peer_servos {
            let (item, ours, theirs) = self.beside(&peer.name, &peer.symbol)?;
            let (any, own) = (self.counts(&peer.any)?, self.counts(&item.measured)?);
            let c = self.counts(&peer.symbol)?;
            let ratio = |of: Counts| of.mean as f64 / c.mean as f64;
            println!(
                "| {} | {any} | {own} | {c} | {:.2} | {:.2} | {} | {} | {} | {} |",
                peer.name,
                ratio(any),
                ratio(own),
                ours.cycles,
                theirs.cycles,
                self.along(&item.measured),
                self.along(&peer.symbol),
            );
        }
        Ok(())
    }
}
