//! `clutch friction`.

use crate::args::key_value;
use crate::output::{Exit, paragraph, print, tell, to_write, wrote};
use crate::plot::{self, Figure, Panel, Series};
use anyhow::Context;
use clap::{Args, Subcommand};
use clutch_core::friction::FrictionParams;
use clutch_core::params::Choice;
use clutch_sim::friction_lab::{Lab, examine};
use clutch_sim::{Scenario, nearest};
use std::path::PathBuf;

/// Lists the friction models, and draws them side by side.
#[derive(Args)]
#[command(
    after_help = "Example:\n  clutch friction list\n  clutch friction plot stribeck lugre elasto_plastic --out friction.svg"
)]
pub(crate) struct FrictionVerb {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Lists the models with their parameters and defaults.
    #[command(after_help = "Example:\n  clutch friction list")]
    List,
    /// Draws models: steady sliding, pre-sliding, lag and break-away.
    #[command(
        after_help = "Example:\n  clutch friction plot stribeck lugre\n  clutch friction plot lugre --set lugre.damping_s_rad=1 --out soft.png"
    )]
    Plot {
        /// Names of models; `clutch friction list` has them.
        #[arg(required = true, value_name = "NAME")]
        names: Vec<String>,
        /// Overrides a parameter, as `lugre.damping_s_rad=1`; may be given several times.
        #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
        set: Vec<(String, String)>,
        /// The figure: .svg or .png.
        #[arg(long, value_parser = to_write(), value_name = "FILE", default_value = "friction.svg")]
        out: PathBuf,
    },
}

/// The friction of that name, with its defaults and these values over them.
fn friction(name: &str, set: &[(String, String)]) -> anyhow::Result<FrictionParams> {
    let options = <FrictionParams as Choice<f64>>::CHOICE.options;
    let names: Vec<&str> = options.iter().map(|option| option.key).collect();
    options.iter().find(|option| option.key == name).with_context(|| {
        let meant = nearest(name, &names);
        format!("no friction model is called {name}; expected one of: {}{meant}", names.join(", "))
    })?;
    let text = format!(
        "name = \"friction\"\n[rig]\nbase = \"paper\"\n[rig.friction.{name}]\n[law.pd]\n[reference.ramp]\nrate_deg_s = 2.0\n"
    );
    let own = |(key, _): &&(String, String)| key.split('.').next() == Some(name);
    let set: Vec<_> = set.iter().filter(own).map(|(k, v)| (format!("rig.friction.{k}"), v.clone())).collect();
    Ok(Scenario::parse("friction", &text, &set)?.params().rig.friction)
}

impl FrictionVerb {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        match self.verb {
            Verb::List => print(&list())?,
            Verb::Plot { names, set, out } => {
                plot::figure_format(&out)?;
                if let Some((_, name)) = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name))
                {
                    anyhow::bail!("{name}: named twice");
                }
                if let Some((key, _)) =
                    set.iter().find(|(key, _)| !names.iter().any(|n| key.split('.').next() == Some(n)))
                {
                    anyhow::bail!(
                        "--set {key}: expected a key of a model that is drawn, as {}.…",
                        names.join(".… or ")
                    );
                }
                let labs = names
                    .iter()
                    .map(|name| Ok((name.as_str(), examine(&friction(name, &set)?)?)))
                    .collect::<anyhow::Result<Vec<_>>>()?;
                figure(&labs).save(&out)?;
                tell(&wrote(&[&out]))?;
            }
        }
        Ok(Exit::Done)
    }
}

fn list() -> String {
    let mut out = String::new();
    for option in <FrictionParams as Choice<f64>>::CHOICE.options {
        out += &paragraph(&format!("{}: {}", option.key, option.doc));
        for row in option.table.rows {
            let unit = if row.unit.text.is_empty() { String::new() } else { format!(" {}", row.unit.text) };
            out += &format!("   {:26} {:8} {}{unit}\n", row.key, row.symbol, row.default);
        }
    }
    out + &paragraph(
        "Write them below [rig.friction.NAME] or [model.friction.NAME]; the default is stribeck.",
    )
}

/// The four experiments, a curve for each model.
fn figure(labs: &[(&str, Lab)]) -> Figure {
    let panel = |title: &str, x: &str, y: &str, points: &dyn Fn(&Lab) -> Vec<(f64, f64)>| Panel {
        title: title.to_owned(),
        x_label: x.to_owned(),
        y_label: y.to_owned(),
        series: labs.iter().map(|(name, lab)| Series::new(*name, points(lab))).collect(),
        ..Panel::default()
    };
    let log = |points: &[(f64, f64)]| points.iter().map(|(x, y)| (x.log10(), *y)).collect();
    Figure {
        title: labs.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "),
        columns: 2,
        panels: vec![
            panel("Steady sliding", "log₁₀ of the velocity (rad/s)", "coefficient", &|lab| {
                log(&lab.steady)
            }),
            panel("Pre-sliding", "angle (mrad)", "coefficient", &|lab| {
                lab.pre_sliding.iter().map(|(x, y)| (1e3 * x, *y)).collect()
            }),
            panel("Lag behind the velocity", "velocity (mrad/s)", "coefficient", &|lab| {
                lab.lag.iter().map(|(x, y)| (1e3 * x, *y)).collect()
            }),
            panel("Break-away", "log₁₀ of the rate of torque (N m/s)", "coefficient", &|lab| {
                log(&lab.break_away)
            }),
        ],
        ..Figure::default()
    }
}
