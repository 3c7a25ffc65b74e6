//! The figures of a run: names, units and what each is.

use clutch_sim::metrics::{Detected, Metrics, columns, figure_columns};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Run, Scenario};
use std::collections::BTreeSet;

#[test]
fn a_figures_name_ends_with_its_unit() {
    let suffix = |unit: &str| match unit {
        "1" => "_fraction",
        "s" => "_s",
        "rad" => "_rad",
        "rad s" => "_rad_s",
        "rad/s³" => "_rad_s3",
        "cycles/s" => "_cycles_per_s",
        "N m" => "_nm",
        "V/s" => "_v_s",
        "1/s" => "_per_s",
        other => panic!("{other}: a unit without a suffix"),
    };
    for (name, unit) in Metrics::FIGURES.iter().map(|f| (f.name, f.unit)) {
        assert!(name.ends_with(suffix(unit)), "{name} in {unit}");
    }
    for f in Detected::FIGURES {
        assert!(f.name.ends_with(suffix(f.unit)), "{} in {}", f.name, f.unit);
    }
}

#[test]
fn json_has_each_figure_under_its_field_and_columns_have_them_all() {
    let scenario = Scenario::built_in("pd_2").unwrap().unwrap();
    let run = scenario.run(Keep::Trace, UNWATCHED).unwrap();
    let json = serde_json::to_value((&run.metrics, &run.detected)).unwrap();
    let count = [&json[0], &json[1]].map(|object| object.as_object().unwrap().len());
    assert_eq!(count, [Metrics::FIGURES.len(), Detected::FIGURES.len()]);
    for f in Metrics::FIGURES {
        assert_eq!(json[0][f.field].as_f64(), f.of(&run.metrics), "{}", f.name);
    }
    for f in Detected::FIGURES {
        assert_eq!(json[1][f.field].as_f64(), f.of(&run.detected), "{}", f.name);
    }
    let names: BTreeSet<_> = columns(&run.metrics, &run.detected).map(|(name, _)| name).collect();
    assert_eq!(names.len(), count[0] + count[1]);

    // Without its samples a run has no bounds by counts and voltage, and the same figures else.
    let bare = scenario.run(Keep::Figures, UNWATCHED).unwrap();
    let of = |run: &Run| figure_columns(&run.metrics, &run.detected).collect::<Vec<_>>();
    assert_eq!(of(&bare), of(&run));
    assert_eq!(of(&bare).len(), names.len() - 3);
    assert_eq!(bare.detected.least_cycles_per_s, None);
}
