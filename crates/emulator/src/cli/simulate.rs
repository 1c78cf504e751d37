//! `ts3100 simulate`: cells under random traffic and failures, in virtual time, and the rules that hold whatever happens.
//!
//! Plans and rules are in [`ts3100_simulation`]; here plans are shared out to threads and figures are printed.

use super::exit::NEGATIVE;
use super::output;
use crate::config::args::whole;
use anyhow::Context as _;
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Instant;
use ts3100_simulation::{Failure, Figures, Rule, STEPS_OF_PLAN, recorded, shrunk, simulate};

/// Most threads.
const MAX_JOBS: u64 = 1_024;

/// Put cells of robots to random traffic and failures, and check what must hold whatever happens.
///
/// Everything happens in virtual time and is drawn by the seed: up to three robots with wires, hosts with legal and illegal
/// traffic, operators, faults, legal variation, full and slow disks, power cycles, snapshots that are taken and restored. Rules
/// written from the manual are checked all the while. A plan that breaks one is shrunk to the few steps that it needs, and
/// written as a transcript that `ts3100 diff` replays.
///
/// Exit codes: 0 no rule is broken; 1 one is; 2 wrong usage, or a file that cannot be written.
#[derive(Debug, Args)]
pub(super) struct SimulateArgs {
    /// The seed of the first plan; the next plan has the next seed
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX / 2))]
    seed: u64,
    /// How many steps are carried out at least, 400 to a plan
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = whole(1, u64::MAX / 2))]
    steps: u64,
    /// Plans that are carried out side by side [default: one for each processor]
    #[arg(long, value_name = "N", value_parser = whole(1, MAX_JOBS))]
    jobs: Option<u64>,
    /// Where the transcript of a broken rule is written [default: simulation-SEED.txt]
    #[arg(long, value_name = "FILE", value_parser = crate::config::args::written_file())]
    out: Option<PathBuf>,
    /// Print the figures as one JSON document
    #[arg(long)]
    json: bool,
    /// Plant a defect that this rule has to find
    #[arg(long, value_name = "RULE", value_parser = PossibleValuesParser::new(Rule::ALL.map(|row| row.1)))]
    canary: Option<String>,
}

/// Plans of the threads, and what they have found.
struct Work {
    next: AtomicU64,
    end: u64,
    canary: Option<Rule>,
    found: Mutex<(Figures, Option<Box<Failure>>)>,
}

impl Work {
    /// Carries out plans until there are no more, or a plan before them breaks a rule: so the failure is the same with any
    /// number of threads.
    fn take_part(&self) {
        loop {
            let seed = self.next.fetch_add(1, Ordering::Relaxed);
            let is_over = {
                let found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
                found.1.as_ref().is_some_and(|failure| failure.seed < seed)
            };
            if seed >= self.end || is_over {
                return;
            }
            let mut figures = Figures::default();
            let result = simulate(seed, self.canary, &mut figures);
            let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
            found.0.add(&figures);
            if let Err(failure) = result
                && found.1.as_ref().is_none_or(|known| known.seed > seed)
            {
                found.1 = Some(failure);
            }
        }
    }
}

/// Simulates; the exit code.
pub(super) fn run(args: &SimulateArgs) -> anyhow::Result<u8> {
    let canary = args.canary.as_deref().and_then(Rule::from_name);
    let steps_of_plan = STEPS_OF_PLAN as u64;
    let work = Work {
        next: AtomicU64::new(args.seed),
        end: args.seed + args.steps.div_ceil(steps_of_plan),
        canary,
        found: Mutex::default(),
    };
    let jobs = args
        .jobs
        .unwrap_or_else(|| thread::available_parallelism().map_or(1, |count| count.get() as u64));
    let begun = Instant::now();
    thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| work.take_part());
        }
    });
    let passed = begun.elapsed();
    let (figures, failure) = work.found.into_inner().unwrap_or_else(PoisonError::into_inner);
    if args.json {
        output::print(format!("{}\n", serde_json::to_string(&figures)?))?;
    } else {
        let last = work.end - 1;
        output::print(format!(
            "seeds {} to {last}, {:.1} s\n{figures}",
            args.seed,
            passed.as_secs_f64()
        ))?;
    }
    let Some(failure) = failure else {
        output::tell("no rule is broken\n");
        return Ok(0);
    };
    let failure = shrunk(*failure, canary);
    let seed = failure.seed;
    let path = args
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("simulation-{seed}.txt")));
    recorded(&failure, &path, canary).with_context(|| format!("cannot write {}", path.display()))?;
    let path = path.display();
    output::tell(format!(
        "error: {failure}\nThe transcript of that robot is {path}; replay it with `ts3100 diff {path}`, and the whole plan with \
         `ts3100 simulate --seed {seed} --steps {STEPS_OF_PLAN}`\n"
    ));
    Ok(NEGATIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_after_one_that_breaks_a_rule_are_not_carried_out() {
        let work = Work {
            next: AtomicU64::new(0),
            end: 4,
            canary: Rule::from_name("snapshots"),
            found: Mutex::default(),
        };
        work.take_part();
        let failed = work.found.lock().unwrap().1.as_ref().map(|failure| failure.seed);
        assert_eq!(failed, Some(0));
        assert_eq!(work.next.into_inner(), 2, "the next one is taken and given up");
    }
}
