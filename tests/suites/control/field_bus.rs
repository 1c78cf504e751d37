//! The outputs of the field bus over the control interface, with and without option `io.field_bus`.

use ts3100_tests::bench::{Bench, builder, running};
use ts3100_tests::host::Host;

// clause: T14 T27
#[test]
fn outputs_of_the_field_bus_take_an_option() {
    let robot = running("PROGRAM TEST\nEND\n");
    for line in ["301", "364", "401", "464"] {
        for (status, method, call, body) in [
            (404, "PUT", "", r#"{"on":true}"#),
            (409, "POST", "/pulse", r#"{"seconds":1}"#),
        ] {
            let words = robot.refused(status, method, &format!("/outputs/{line}{call}"), body);
            assert!(words.contains("`io.field_bus = present`"), "{words}");
        }
        robot.put(&format!("/inputs/{line}"), r#"{"on":true}"#);
    }
    let words = robot.refused(404, "PUT", "/outputs/249", r#"{"on":true}"#);
    assert!(!words.contains("field_bus"), "{words}");
    assert_eq!(robot.host().command("HI,301 1"), "FL,1\r\u{1a}");

    let robot = Bench::start(builder().option("io.field_bus", "present").unwrap());
    for line in ["301", "364", "401", "464"] {
        assert_eq!(
            robot.put(&format!("/outputs/{line}"), r#"{"on":true}"#)["on"],
            true
        );
    }
    robot.post("/outputs/302/pulse", r#"{"seconds":1}"#);
    assert_eq!(robot.host().sf()[108..116], [0, 3, 0, 0, 0, 0, 0x80, 0]);
    for line in ["300", "365", "400", "465"] {
        robot.refused(404, "PUT", &format!("/outputs/{line}"), r#"{"on":true}"#);
    }
}
