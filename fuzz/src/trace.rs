//! Fuzzes a recorded run that is open: the first byte says how it is read and which emulator plays it, the next two where it is
//! looked at, the rest is the transcript.
//!
//! Whatever a file says, every moment can be had, directly or by playing forward, and both are the same; the run is told in
//! lines, in lanes, and as one page. One that says that it is of a real robot is shown from its traffic.

use super::recording::{can_be_played, candidate};
use ts3100_driver::snapshot::to_json_line;
use ts3100_recording::transcript::{Recording, json, text};
use ts3100_view::key::MomentKey;
use ts3100_view::run::Run;
use ts3100_view::summary::Summary;
use ts3100_view::{html, list};

/// Most records of a run that is opened: each moment plays some of them.
const MAX_RECORDS: usize = 200;

/// Opens a run and looks at moments of it.
///
/// # Panics
/// When what must hold does not.
pub fn check(data: &[u8]) {
    let [choice, begin, end, content @ ..] = data else {
        return;
    };
    let content = String::from_utf8_lossy(content);
    let read = if choice & 1 == 0 { text::read } else { json::read };
    let Ok(recording) = read(&content) else {
        return;
    };
    let recording: Recording = recording;
    if recording.records.len() > MAX_RECORDS || !can_be_played(&recording) {
        return;
    }
    let Some(candidate) = candidate(&recording, choice) else {
        return;
    };
    let run = if recording.header.is_of_robot() {
        Run::open_robot("fuzz", recording, candidate.controller)
    } else {
        let (run, opening) = Run::open("fuzz", recording, candidate);
        opening.finish();
        run
    };
    let count = run.journal().next_number() - 1;
    let key = |part: u8| MomentKey {
        event: Some(count * u64::from(part) / 255).filter(|event| *event > 0),
        at: None,
    };
    let (first, last) = (begin.min(end), begin.max(end));
    let moments = [*first, *last].map(|part| run.moment(key(part)).unwrap_or_else(|error| panic!("{error}")));
    if let (Some((mut played, _)), Some((sought, _))) = (run.seek(moments[0]), run.seek(moments[1]))
        && moments[0] <= moments[1]
    {
        played.play_to(moments[1]);
        assert_eq!(
            to_json_line(played.controller()),
            to_json_line(sought.controller())
        );
    }
    run.state(key(*last)).unwrap_or_else(|error| panic!("{error}"));
    let lines = list::lines(&run, false);
    assert!(lines.is_sorted_by_key(|line| line.event));
    assert!(!Summary::new(&run).to_text().is_empty());
    let page = html::page(&run).unwrap_or_else(|error| panic!("{error}"));
    // What a file says is never markup.
    assert_eq!(page.matches("<script").count(), 2, "{}", &page[..400]);
}
