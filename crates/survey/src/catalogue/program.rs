//! Questions to the language, and to starts and stops. No axis moves.

use super::ROW;
use crate::forms;
use crate::probe::{Ask, Class, Probe};
use crate::session::{FILE, ProbeError, Reply, Session};
use std::time::Duration;
use ts3100_proto::status::ExecutionStatus;

pub(super) const PROGRAM: Probe = Probe {
    class: Class::Program,
    ..ROW
};

/// How long an unsolicited SP is waited for.
const STOP_NOTICE: Duration = Duration::from_millis(700);
/// How long a program that ought to wait is given to show it.
pub(super) const SETTLED: Duration = Duration::from_secs(1);

/// A program that puts a value into R; `R` begins as 7. More follows it in the file, where given.
macro_rules! computes {
    ($body:literal $(, $more:literal)?) => {
        concat!("GLOBAL\r\nR = 7.0\r\nEND\r\nPROGRAM SURVEY\r\n", $body, "END\r\n" $(, $more)?)
    };
}

/// A program that reads a variable without a value.
const WITHOUT_VALUE: &str =
    "GLOBAL\r\nR = 7.0\r\nU\r\nF = 0\r\nEND\r\nPROGRAM SURVEY\r\nIF F == 1 THEN U = 1\r\nR = U\r\nEND\r\n";

pub(super) const PROBES: &[Probe] = &[
    // First: without it the answers of the others mean nothing.
    Probe {
        id: "value",
        question: "Does MR give what a program has assigned?",
        sends: "a program: R = 1234.5",
        ask: Ask::Value(computes!("R = 1234.5\r\n")),
        readings: &["1234.5"],
        ..PROGRAM
    },
    Probe {
        id: "int-division",
        question: "What is 7/2?",
        sends: "a program: R = 7/2",
        ask: Ask::Value(computes!("N = 7\r\nM = 2\r\nR = N/M\r\n")),
        readings: &["3", "3.5", "4"],
        decides: Some(("scol.int_division", &["truncate", "real"])),
        ..PROGRAM
    },
    Probe {
        id: "int-division-negative",
        question: "What is -7/2?",
        sends: "a program: R = -7/2",
        ask: Ask::Value(computes!("N = -7\r\nM = 2\r\nR = N/M\r\n")),
        readings: &["-3", "-3.5", "-4"],
        ..PROGRAM
    },
    Probe {
        id: "first-kind",
        question: "Does a variable that began as an integer stay one?",
        sends: "a program: N = 1, N = 2.7, R = N",
        ask: Ask::Value(computes!("N = 1\r\nN = 2.7\r\nR = N\r\n")),
        readings: &["2", "2.7", "3"],
        ..PROGRAM
    },
    Probe {
        id: "equal-within",
        question: "By how much may two reals differ and be equal?",
        sends: "a program: a search for the largest X with X == 0.0",
        ask: Ask::Steps(equal_within),
        readings: &["0", "0.001", "*"],
        decides: Some(("scol.equal_within", &["0", "0.001", "*"])),
        with_other_arm: Some("0.001"),
        ..PROGRAM
    },
    Probe {
        id: "unknown-input",
        question: "What is DIN of a number that no input has?",
        sends: "a program: R = DIN(999)",
        ask: Ask::Stops(computes!("N = 999\r\nA = 5\r\nA = DIN(N)\r\nR = A\r\n")),
        readings: &["stopped", "0"],
        decides: Some(("scol.din_unknown", &["alarm", "zero"])),
        ..PROGRAM
    },
    Probe {
        id: "undefined-variable",
        question: "What is a global variable that nobody has given a value?",
        sends: "a program: R = U",
        ask: Ask::Stops(WITHOUT_VALUE),
        readings: &["stopped", "0"],
        ..PROGRAM
    },
    Probe {
        id: "alarm-date",
        question: "How does AC write the year of an alarm?",
        sends: "a program: R = U, which an alarm stops; AC",
        ask: Ask::Word(|session| {
            session.try_run(WITHOUT_VALUE)?;
            let content = session.content("AC")?;
            Ok(content.map_or("no AC", |content| forms::alarm_year(&content)))
        }),
        readings: &["four digits", "two digits", "no AC"],
        decides: Some(("ac.date", &["yyyy", "yy"])),
        // A survey takes two minutes at most.
        is_slow: true,
        ..PROGRAM
    },
    Probe {
        id: "loop-variable",
        question: "What is the variable of FOR I = 1 TO 3 after the loop?",
        sends: "a program: FOR I = 1 TO 3, NEXT I, R = I",
        ask: Ask::Value(computes!("FOR I = 1 TO 3\r\nN = I\r\nNEXT I\r\nR = I\r\n")),
        readings: &["4", "3"],
        ..PROGRAM
    },
    Probe {
        id: "loop-empty",
        question: "How often runs FOR I = 3 TO 1?",
        sends: "a program: FOR I = 3 TO 1, R = R + 1, NEXT I",
        ask: Ask::Value(computes!("R = 0\r\nFOR I = 3 TO 1\r\nR = R + 1\r\nNEXT I\r\n")),
        readings: &["0", "1"],
        ..PROGRAM
    },
    Probe {
        id: "data-copy",
        question: "Does a subprogram see what its caller has assigned to a name of DATA?",
        sends: "a program: P.X = 5, and a subprogram: R = P.X",
        ask: Ask::Value(computes!(
            "PSURV.X = 5\r\nSURVEY2\r\n",
            "PROGRAM SURVEY2\r\nR = PSURV.X\r\nEND\r\nDATA\r\nPOINT PSURV = 1,2,3\r\nEND\r\n"
        )),
        readings: &["5", "1"],
        decides: Some(("scol.data_copy", &["false", "true"])),
        ..PROGRAM
    },
    Probe {
        id: "too-many-numbers",
        question: "Is a position with too many numbers refused?",
        sends: "a program with a POINT of twelve numbers, selected",
        ask: Ask::Selects(
            "PROGRAM SURVEY\r\nEND\r\nDATA\r\nPOINT PSURV = 1,2,3,4,5,6,7,8,9,10,11,12\r\nEND\r\n",
        ),
        readings: &["refused", "accepted"],
        ..PROGRAM
    },
    Probe {
        id: "braces",
        question: "Do braces after WORK make a coordinate?",
        sends: "a program with WORK = {0,0,0}, selected",
        ask: Ask::Selects("PROGRAM SURVEY\r\nWORK = {0,0,0}\r\nEND\r\n"),
        readings: &["accepted", "refused"],
        ..PROGRAM
    },
    Probe {
        id: "jump-into-loop",
        question: "Is a jump into a FOR loop refused?",
        sends: "a program with a GOTO into a loop, selected",
        ask: Ask::Selects("PROGRAM SURVEY\r\nGOTO L1\r\nFOR I = 1 TO 2\r\nL1: R = 1\r\nNEXT I\r\nEND\r\n"),
        readings: &["accepted", "refused"],
        ..PROGRAM
    },
    Probe {
        id: "monitor",
        question: "Does ON ... DO act when its condition becomes true?",
        sends: "a program: ON F == 1 DO R = 5, F = 1, DELAY 0.1",
        ask: Ask::Value(computes!(
            "F = 0\r\nON F == 1 DO R = 5\r\nDELAY 0.1\r\nF = 1\r\nDELAY 0.1\r\n"
        )),
        readings: &["5", "7"],
        ..PROGRAM
    },
    Probe {
        id: "task-variables",
        question: "Has each task variables of its own?",
        sends: "a program that starts a second task; both assign to N",
        ask: Ask::Value(computes!(
            "N = 1\r\nI = TASK(\"SURVEY2\")\r\nDELAY 0.2\r\nR = N\r\n",
            "PROGRAM SURVEY2\r\nN = 2\r\nEND\r\n"
        )),
        readings: &["1", "2"],
        ..PROGRAM
    },
    Probe {
        id: "product",
        question: "Is the second factor of P * T relative to the first?",
        sends: "a program: R = X of a position turned by 90 degrees, times a shift by 10 in Y",
        ask: Ask::Steps(|session| {
            let turned = match session.total_status()?.0 {
                "one text, SCARA" => "0,0,0,90",
                _ => "0,0,0,0,0,90",
            };
            let source = format!(
                "GLOBAL\r\nR = 7.0\r\nEND\r\nPROGRAM SURVEY\r\nP = POINT({turned})*TRANS(0,10)\r\nR = P.X\r\nEND\r\n"
            );
            session.run(&source)?;
            Ok(plain(&session.variable("R", 1)?))
        }),
        readings: &["-10", "0", "10"],
        is_public: false,
        ..PROGRAM
    },
    Probe {
        id: "global-array",
        question: "Does an array of GLOBAL without initial values survive RS,PRG?",
        sends: "a program with an array, run before and after RS,PRG",
        ask: Ask::Steps(|session| {
            let source = "GLOBAL\r\nR = 7.0\r\nDIM TBL(2) AS INTEGER\r\nEND\r\nPROGRAM SURVEY\r\nR = TBL(1)\r\nTBL(1) = 5\r\nEND\r\n";
            session.run(source)?;
            session.command("RS,PRG")?;
            session.start()?;
            session.finish()?;
            Ok(plain(&session.variable("R", 1)?))
        }),
        readings: &["5", "0"],
        ..PROGRAM
    },
    Probe {
        id: "reset-locals",
        question: "Does a variable of the program survive RS,STP?",
        sends: "a program that gives N a value in its first run and reads it in the next; RS,STP between them",
        ask: Ask::Word(|session| {
            let source = "GLOBAL\r\nR = 7.0\r\nF = 0\r\nEND\r\nPROGRAM SURVEY\r\nIF F == 1 THEN GOTO L1\r\nN = 5\r\n\
                F = 1\r\nGOTO L2\r\nL1: R = N\r\nL2:\r\nEND\r\n";
            session.run(source)?;
            session.command("RS,STP")?;
            session.start()?;
            session.finish()?;
            Ok(match plain(&session.variable("R", 1)?).as_str() {
                "5" => "it stays",
                // An alarm stops the program, or what has no value counts as 0.
                "7" | "0" => "it has no value",
                _ => "another value",
            })
        }),
        readings: &["it stays", "it has no value"],
        decides: Some(("scol.reset_locals", &["false", "true"])),
        ..PROGRAM
    },
    Probe {
        id: "restore",
        question: "Does RESTORE write a value into the file?",
        sends: "a program with a global of 1: it becomes 5, RESTORE; UL",
        ask: Ask::Word(|session| {
            session.run("GLOBAL\r\nSURV = 1\r\nEND\r\nPROGRAM SURVEY\r\nSURV = 5\r\nRESTORE\r\nEND\r\n")?;
            let content = session.content(&format!("UL,{FILE}"))?.unwrap_or_default();
            let text = String::from_utf8_lossy(&content).replace(' ', "");
            let is_written = text
                .split("END")
                .next()
                .is_some_and(|globals| globals.contains("SURV=5"));
            Ok(if is_written { "written" } else { "not written" })
        }),
        readings: &["written", "not written"],
        ..PROGRAM
    },
    Probe {
        id: "start-without-file",
        question: "What is answered to RN without a selected file?",
        sends: "RS,SEL, RN",
        ask: Ask::Word(|session| {
            session.command("RS,SEL")?;
            session.acknowledgement("RN")
        }),
        readings: &["NG", "OK"],
        ..PROGRAM
    },
    Probe {
        id: "download-selected",
        question: "What happens to a stopped program whose file is stored again?",
        sends: "a program with DELAY 0.8; RN, SP; DL of the same file",
        ask: Ask::Word(|session| {
            let source = computes!("DELAY 0.8\r\nR = 1\r\nDELAY 1\r\n");
            session.select(source)?;
            session.begin()?;
            session.command("SP")?;
            session.finish()?;
            session.store(source)?;
            Ok(session.status()?.execution.as_str())
        }),
        readings: &["stop (reset)", "stop (continue)"],
        ..PROGRAM
    },
    Probe {
        id: "motion-at-rest",
        question: "What is REMAIN while the arm rests?",
        sends: "a program: R = REMAIN",
        ask: Ask::Value(computes!("R = REMAIN\r\n")),
        readings: &["0", "100"],
        ..PROGRAM
    },
    Probe {
        id: "task-number",
        question: "Which number has the first task?",
        sends: "a program: R = TID",
        ask: Ask::Value(computes!("R = TID\r\n")),
        readings: &["1", "0"],
        ..PROGRAM
    },
    Probe {
        id: "timer",
        question: "What does TIMER count?",
        sends: "a program: TIMER = 0, DELAY 1, R = INT(TIMER + 0.5)",
        ask: Ask::Value(computes!("TIMER = 0\r\nDELAY 1\r\nR = INT(TIMER + 0.5)\r\n")),
        readings: &["1", "10", "100", "1000"],
        ..PROGRAM
    },
    Probe {
        id: "loop-time",
        question: "How many seconds do 500 turns of an empty loop take?",
        sends: "a program: TIMER = 0, FOR I = 1 TO 500, NEXT I, R = TIMER",
        ask: Ask::Value(computes!(
            "TIMER = 0\r\nFOR I = 1 TO 500\r\nNEXT I\r\nR = TIMER\r\n"
        )),
        readings: &["0.05", "*"],
        ..PROGRAM
    },
    Probe {
        id: "label-rcycle",
        question: "What is answered to RS,CYC without the label RCYCLE?",
        sends: "a program without RCYCLE, selected; RS,CYC",
        ask: Ask::Word(|session| {
            session.select("PROGRAM SURVEY\r\nEND\r\n")?;
            session.acknowledgement("RS,CYC")
        }),
        readings: &["OK", "NG"],
        decides: Some(("rs.cycle_without_label", &["as-step", "ng"])),
        ..PROGRAM
    },
    Probe {
        id: "erase-selected",
        question: "What is answered to ER of the selected file?",
        sends: "a program, selected; ER",
        ask: Ask::Word(|session| {
            session.select("PROGRAM SURVEY\r\nEND\r\n")?;
            session.acknowledgement(&format!("ER,{FILE}"))
        }),
        readings: &["NG", "OK"],
        ..PROGRAM
    },
    Probe {
        id: "stop-in-delay",
        question: "Where does SP inside a DELAY stop a program?",
        sends: "a program: DELAY 0.8, R = 1; RN, SP",
        ask: Ask::Word(|session| {
            session.select(computes!("DELAY 0.8\r\nR = 1\r\n"))?;
            session.begin()?;
            session.command("SP")?;
            Ok(session.finish()?.map_or("running", ExecutionStatus::as_str))
        }),
        readings: &["stop (continue)", "stop (retry)", "stop (reset)"],
        ..PROGRAM
    },
    Probe {
        id: "wait-after-stop",
        question: "Where does a program continue that SP has stopped inside a WAIT?",
        sends: "a program: WAIT for what never comes, R = 1; RN, SP, RN",
        ask: Ask::Word(wait_after_stop),
        readings: &["after the WAIT", "at the WAIT"],
        decides: Some(("wait.after_stop", &["next", "again"])),
        ..PROGRAM
    },
    Probe {
        id: "unsolicited-stop",
        question: "Is SP sent when a program has ended?",
        sends: "a program that ends, on connections with texts of each form",
        ask: Ask::Word(unsolicited_stop),
        readings: &[
            "not to a host without STX",
            "to every host",
            "never",
            "to hosts with STX, and no other is served",
        ],
        decides: Some(("sp.unsolicited", &["auto", "true", "false"])),
        ..PROGRAM
    },
];

/// A number without needless digits; any other text as it is.
pub(crate) fn plain(value: &str) -> Reply {
    match value.parse::<f64>() {
        Ok(number) => format!("{number}"),
        Err(_) => value.to_owned(),
    }
}

/// The largest difference at which a real is equal to 0, to four digits: the program halves an interval.
fn equal_within(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    let source = computes!(
        "L = 0.0\r\nH = 2000.0\r\nFOR I = 1 TO 50\r\nM = (L + H)/2\r\nIF M == 0.0 THEN GOTO YES\r\nH = M\r\nGOTO OK\r\n\
         YES: L = M\r\nOK: NEXT I\r\nR = L*1000\r\n"
    );
    session.run(source)?;
    let thousandths: f64 = session
        .variable("R", 1)?
        .parse()
        .map_err(|_| ProbeError::Unexpected("MR gave no number".to_owned()))?;
    // MR writes three decimals; a real has seven digits.
    let value = thousandths / 1000.0;
    let digits = format!("{value:.3e}").parse::<f64>().unwrap_or(value);
    Ok(plain(&format!("{digits}")))
}

fn wait_after_stop(session: &mut Session<'_>) -> Result<&'static str, ProbeError> {
    session
        .select("GLOBAL\r\nR = 0.0\r\nF = 0\r\nEND\r\nPROGRAM SURVEY\r\nWAIT F == 1\r\nR = 1\r\nEND\r\n")?;
    session.begin()?;
    session.command("SP")?;
    if session.until_stopped(SETTLED)?.is_none() {
        session.command("EC,BREAK")?;
        return Ok("SP does not stop it");
    }
    session.start()?;
    let ended = session.until_stopped(SETTLED)?;
    let value = plain(&session.variable("R", 1)?);
    let heard = match (ended, value.as_str()) {
        (Some(_), "1") => "after the WAIT",
        (None, "0") => "at the WAIT",
        _ => "somewhere else",
    };
    if ended.is_none() {
        session.command("SP")?;
        session.until_stopped(SETTLED)?;
    }
    Ok(heard)
}

/// Runs a program that ends by itself. Returns whether SP has come.
fn is_told_of_the_end(session: &mut Session<'_>) -> Result<bool, ProbeError> {
    session.take_stops();
    session.start()?;
    session.finish()?;
    session.wait(STOP_NOTICE)?;
    Ok(session.take_stops() > 0)
}

/// That SP has not come says something on a fresh connection only: a controller may send none once a text without STX has come.
pub(super) fn trust(session: &Session<'_>, is_told: bool) -> Result<bool, ProbeError> {
    match !is_told && session.is_serial() {
        true => Err(ProbeError::Refused(
            "no SP came, and a serial line has no fresh connection".to_owned(),
        )),
        false => Ok(is_told),
    }
}

fn unsolicited_stop(session: &mut Session<'_>) -> Result<&'static str, ProbeError> {
    session.reopen()?;
    session.select("PROGRAM SURVEY\r\nDELAY 0.3\r\nEND\r\n")?;
    let is_told = is_told_of_the_end(session)?;
    if !trust(session, is_told)? {
        return Ok("never");
    }
    session.reopen()?;
    let text = session.text("SU\r");
    let bare = text.get(1..).unwrap_or_default();
    let is_bare_served = session.reply_kind(bare)? == "answer without STX";
    let is_extension_served = session.content("SM,1")?.is_some();
    let is_told = is_told_of_the_end(session)?;
    session.reopen()?;
    Ok(match (is_told, is_bare_served || is_extension_served) {
        (true, true) => "to every host",
        (false, true) => "not to a host without STX",
        (true, false) => "to hosts with STX, and no other is served",
        (false, false) => "to hosts with STX only, and no other is served",
    })
}

pub(super) use computes;
