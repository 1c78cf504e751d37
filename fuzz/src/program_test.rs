//! Fuzzes the files of tests of SCOL programs: reads one and runs its first tests with a program that is always the same.
//!
//! A file is refused at a place of its text, or each test passes or fails at such places and does so again.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use ts3100_controller::{Config, Dialect};
use ts3100_emulator::program_test::{Subject, TestError, run};
use ts3100_recording::program_test::{Place, Placed, ProgramTestError, TestFile};

/// Most tests of a file that are run.
const MAX_TESTS: usize = 3;
/// Longest run: steps that trigger each other every microsecond take no longer than an input may.
const LIMIT: Duration = Duration::from_millis(150);

/// GLOBAL of each type, calls, PRINT, INPUT, a monitor, a task, a wait, a motion.
const PROGRAM: &str = "GLOBAL\n  COUNT = 0\n  SIZE = 1.5\n  DIM GRID(2,1) AS INTEGER\nEND\nPROGRAM MAIN\n  ON DIN(7) DO COUNT = 9\n  \
    T = TASK(\"BELT\")\n  WAIT DIN(5)\n  PUT(2, 0.5)\n  PRINT IP1, \"DONE\", COUNT, CR\n  DOUT(8)\nEND\nPROGRAM PUT(ROW, H)\n  \
    COUNT = COUNT + ROW\n  MOVE P1 + POINT(0, ROW, H)\nEND\nPROGRAM ASK(N)\n  INPUT IP1, N\n  PRINT \"GOT\", N, CR\nEND\n\
    PROGRAM BELT\n  DOUT(1)\n  DELAY 0.05\nEND\nDATA\n  POINT P1 = 400, 0, 200, 0, 0, 0, 0, 0 / 11111\nEND\n";

/// Reads a file of tests and runs it.
///
/// # Panics
/// When what must hold does not.
pub fn check(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let lines = text.split('\n').count();
    let holds = |place: Place| (1..=lines).contains(&place.line) && place.column >= 1;
    let mut file = match TestFile::parse(Path::new("main.test.toml"), &text) {
        Ok(file) => file,
        Err(ProgramTestError::Content { place, reason, .. }) => {
            assert!(holds(place) && !reason.is_empty(), "{place:?}: {reason}");
            return;
        }
        Err(ProgramTestError::Io(error)) => panic!("nothing is read: {error}"),
    };
    let config = Config::new(Dialect::default());
    let program = config.compile(PROGRAM).program.expect("the program compiles");
    let subject = Subject {
        name: "MAIN".to_owned(),
        source: PROGRAM.to_owned(),
        config,
        program,
    };
    for test in file.tests.iter_mut().take(MAX_TESTS) {
        let limit = test.limit.as_ref().map_or(LIMIT, |limit| limit.value.min(LIMIT));
        test.limit = Some(Placed {
            place: test.place,
            value: limit,
        });
        let never = AtomicBool::new(false);
        match (run(&subject, test, &never), run(&subject, test, &never)) {
            (Ok(result), Ok(again)) => {
                assert_eq!(result, again);
                assert!(result.duration <= limit);
                for failure in &result.failures {
                    assert!(holds(failure.place) && !failure.message.is_empty(), "{failure:?}");
                }
            }
            (Err(TestError::Call { place, reason }), Err(_)) => {
                assert!(holds(place) && !reason.is_empty(), "{place:?}: {reason}");
            }
            (result, _) => panic!("{}: {result:?}", test.name),
        }
    }
}
