//! What a step of every filter costs on the Cortex-M7, as `cargo xtask study-cost` counted it. The figures are of the studies
//! as they fly when nothing is set; a study with other settings has none. A filter that stops on its way was counted up to that step.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use crate::settings::parse;

/// Instructions of a step by study and filter.
const RECORDED: &str = include_str!("../m7-cost.toml");

type Table = BTreeMap<String, BTreeMap<String, u64>>;

/// Instructions of a step of a filter, the mean over a flight, by the names of [`crate::counted`].
#[must_use]
pub fn instructions(study: &str, filter: &str) -> Option<f64> {
    static TABLE: OnceLock<Table> = OnceLock::new();
    // A file that cannot be read has no figures; a test reads it.
    let table = TABLE.get_or_init(|| parse(RECORDED).unwrap_or_default());
    table.get(study)?.get(filter).map(|count| *count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::counted::each;

    #[test]
    fn every_filter_has_its_count_and_no_other_has() {
        let mut recorded: Table = parse(RECORDED).unwrap();
        each(|counted| {
            let found = recorded.get_mut(counted.study).and_then(|study| study.remove(counted.filter));
            assert!(found.is_some(), "{} {}", counted.study, counted.filter);
        });
        assert!(recorded.values().all(BTreeMap::is_empty), "no filters: {recorded:?}");
    }

    #[test]
    fn only_a_study_whose_filters_do_the_same_work_has_the_recorded_cost() {
        let mut ddf = crate::ddf::Config::default();
        ddf.filters.fly.truncate(3);
        assert!(ddf.has_recorded_cost());
        ddf.filters.free_thresholds = vec![0.5];
        assert!(!ddf.has_recorded_cost());
        let mut sekf = crate::sekf::config::Config::default();
        sekf.tuning.runs += 1;
        assert!(sekf.has_recorded_cost());
        sekf.sensors.beacons_km.truncate(1);
        assert!(!sekf.has_recorded_cost());
        let mut mmae = crate::mmae::config::Config::default();
        mmae.filters.fly.truncate(2);
        assert!(mmae.has_recorded_cost());
        mmae.bank.densities.truncate(3);
        assert!(!mmae.has_recorded_cost());
    }

    #[test]
    fn a_filter_that_nobody_counted_has_no_figure() {
        assert!(instructions("ddf", "RDDF1").is_some_and(|count| count > 1e4));
        assert_eq!((instructions("ddf", "RDDF3"), instructions("npc", "RDDF1")), (None, None));
    }
}
