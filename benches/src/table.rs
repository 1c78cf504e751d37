//! The table of statements per second, and which of its ratios are out of the margin.

use crate::contender::{self, Contender, Lap};
use std::collections::BTreeMap;

/// `--check` fails when the machine is not faster than CPython by this.
const PYTHON_SLOWER: f64 = 2.0;
/// Reals of 32 bits come to a slightly different sum than those of 64.
const TOLERANCE: f64 = 0.02;

/// What a loop came to.
pub struct Row {
    name: &'static str,
    statements: u32,
    /// The seconds of each round.
    seconds: BTreeMap<Contender, Vec<f64>>,
}

impl Row {
    /// Runs a loop on all contenders in turn, as often as `rounds`.
    pub fn measure(name: &'static str, contenders: &[Contender], rounds: usize) -> Result<Row, String> {
        let statements = contender::statements(name)?;
        let mut laps: BTreeMap<Contender, Vec<Lap>> = BTreeMap::new();
        for _ in 0..rounds {
            for &contender in contenders {
                laps.entry(contender).or_default().push(contender.run(name)?);
            }
        }
        let results = laps.values().flatten().map(|lap| lap.result);
        let (least, most) = results.fold((f64::MAX, f64::MIN), |(least, most), result| {
            (least.min(result), most.max(result))
        });
        if most - least > TOLERANCE * most.abs().max(1.0) {
            return Err(format!("{name}: the contenders disagree, {least} to {most}"));
        }
        let seconds = |laps: Vec<Lap>| laps.iter().map(|lap| lap.seconds).collect();
        Ok(Row {
            name,
            statements,
            seconds: laps.into_iter().map(|(who, laps)| (who, seconds(laps))).collect(),
        })
    }

    /// How much faster `who` is than the machine: the median of the ratios of each round. The processor changes its
    /// speed between rounds, by more than the margins; within a round both run at the same.
    fn ratio(&self, who: Contender) -> Option<f64> {
        let machine = self.seconds.get(&Contender::Machine)?.iter();
        let ratios = machine
            .zip(self.seconds.get(&who)?)
            .map(|(machine, who)| machine / who);
        Some(median(ratios.collect()))
    }
}

/// The middle one, or the mean of the two in the middle.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values.len().saturating_sub(1) / 2, values.len() / 2);
    match (values.get(low), values.get(high)) {
        (Some(low), Some(high)) => f64::midpoint(*low, *high),
        _ => f64::NAN,
    }
}

/// Prints the table.
pub fn print(rows: &[Row], contenders: &[Contender]) {
    print!("{:10} {:>12}", "loop", "statements");
    contenders.iter().for_each(|who| print!(" {:>11}", who.name()));
    println!("   {:>10} {:>7} {:>8}", "controller", "/ lua", "/ python");
    for row in rows {
        print!("{:10} {:>12}", row.name, row.statements);
        for who in contenders {
            let seconds = row.seconds.get(who).cloned().map_or(f64::NAN, median);
            print!(" {:>11.1}", f64::from(row.statements) / seconds / 1e6);
        }
        let ratio = |who| {
            row.ratio(who)
                .map_or_else(|| "-".to_string(), |ratio| format!("{:.2}", 1.0 / ratio))
        };
        let controller = row
            .ratio(Contender::Controller)
            .map_or_else(String::new, |ratio| format!("{ratio:.2}"));
        println!(
            "   {controller:>10} {:>7} {:>8}",
            ratio(Contender::Lua),
            ratio(Contender::Python)
        );
    }
}

/// Which loops are too slow beside CPython, in words.
pub fn missed(rows: &[Row]) -> Vec<String> {
    let slow = rows.iter().filter_map(|row| {
        let python = row.ratio(Contender::Python)?;
        (python > 1.0 / PYTHON_SLOWER).then(|| {
            format!(
                "{}: python3 runs at {python:.2} times the speed of the machine, at most 1/{PYTHON_SLOWER} expected",
                row.name
            )
        })
    });
    slow.collect()
}
