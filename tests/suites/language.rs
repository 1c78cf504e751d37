//! The language and the controller together: points taught on the controller, what a program reads of the robot, and what
//! it writes back into its file.
//!
//! The language alone is tested in `scol-mini`; whole programs are in `programs.rs`.

use crate::extensions::scara_of;
use crate::variables::read;
use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, Controller, Dialect, Output, PanelAction, Port};
use ts3100_tests::Robot;

/// A robot with these points, as `--points` gives them, and nothing selected.
fn taught(model: ArmModel, table: &str) -> Robot {
    let mut config = Config::new(Dialect::Field);
    config.points = scol_mini::parse_points(table, model.language()).unwrap();
    config.model = model;
    let mut robot = Robot::with(config);
    robot.connect(Port::Ip0);
    robot.connect(Port::Ip1);
    robot.panel(PanelAction::Servo(true));
    robot
}

const TABLE: &str = "NAME,X,Y,Z,C,T,CONFIG\nT1,250,100,20,30,0,LEFTY\nE1,200,-150,10,0,0,RIGHTY\n";
/// A program as it is published: its points are in the controller (scol.md 13.14).
const BARE: &str = "PROGRAM PICK\nMOVE T1\nMOVE E1 + POINT(,, 5)\nPRINT IP1, T1.X, CR\nEND\n";

#[test]
fn a_file_without_data_finds_the_taught_points() {
    let mut robot = taught(ArmModel::thl400(), TABLE);
    robot.load("PICK", BARE);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(10_000);
    assert_eq!(robot.alarms(), Vec::<String>::new());
    assert_eq!(robot.received(Port::Ip1), b"     250.000\r");
    robot.received(Port::Ip0);
    let world = robot.seat.controller.arm_pose().world_values();
    assert!(
        (world[1] + 150.0).abs() < 1e-6 && (world[2] - 15.0).abs() < 1e-6,
        "{world:?}"
    );
    assert_eq!(robot.ask(Port::Ip0, "DO,MOVE T1"), b"OK\r");
    robot.advance_ms(5_000);
    assert_eq!(robot.alarms(), Vec::<String>::new());

    // GLOBAL and DATA of a file come first.
    let own = "GLOBAL\nT1 = 7\nEND\nPROGRAM P\nPRINT IP1, T1, E1.X, CR\nEND\nDATA\nPOINT E1=1,2/\nEND\n";
    robot.load("OWN", own);
    robot.received(Port::Ip0);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Ip1), b"           7       1.000\r");
}

#[test]
fn six_axes_take_the_same_table_with_their_coordinates() {
    let mut robot = taught(ArmModel::tv800(), "A1,400,0,200,0,0,0,0,0,LANSS\n");
    robot.load("P", "PROGRAM P\nMOVE A1\nEND\n");
    assert_eq!(
        read(&mut robot, "A1 4"),
        "400.000 0.000 200.000 0.000 0.000 0.000 0.000 0.000 11111.000"
    );
}

// clause: CMD-MR-01 CMD-MW-02 S15
#[test]
fn hosts_reach_taught_points_and_restore_them_into_the_file() {
    let mut robot = taught(ArmModel::thl400(), TABLE);
    robot.load("PICK", BARE);
    assert_eq!(
        read(&mut robot, "T1 4"),
        "250.000 100.000 20.000 30.000 0.000 1.000"
    );
    assert_eq!(robot.ask(Port::Ip0, "MW,0 T1 4 240 110 20 30 0 2"), b"OK\r");
    assert_eq!(
        read(&mut robot, "T1 4"),
        "240.000 110.000 20.000 30.000 0.000 2.000"
    );
    robot.command(Port::Ip0, "RS,PRG");
    assert_eq!(
        read(&mut robot, "T1 4"),
        "250.000 100.000 20.000 30.000 0.000 1.000"
    );
    for (point, line) in [("T1", "T1=240,110,20,30,0/RIGHTY"), ("E1", "E1=200,-140,10,4,5/")] {
        let values = if point == "T1" {
            "240 110 20 30 0 2"
        } else {
            "200 -140 10 4 5 0"
        };
        assert_eq!(robot.ask(Port::Ip0, &format!("MW,1 {point} 4 {values}")), b"OK\r");
        assert!(stored(&robot).contains(line), "{}", stored(&robot));
    }
    assert_eq!(
        stored(&robot),
        format!("{BARE}DATA\nPOINT E1=200,-140,10,4,5/\nPOINT T1=240,110,20,30,0/RIGHTY\nEND\n")
    );
    robot.command(Port::Ip0, "RS,PRG");
    assert_eq!(
        read(&mut robot, "E1 4"),
        "200.000 -140.000 10.000 4.000 5.000 0.000"
    );
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(10_000);
    assert_eq!(robot.received(Port::Ip1), b"     240.000\r");
}

/// The content of the selected file as it was last sent to the edge.
fn stored(robot: &Robot) -> String {
    let mut contents = robot.outputs.iter().filter_map(|output| match output {
        Output::Stored { content, .. } => Some(content),
        _ => None,
    });
    String::from_utf8(contents.next_back().unwrap().to_vec()).unwrap()
}

#[test]
fn a_restored_controller_knows_its_points() {
    let mut robot = taught(ArmModel::thl400(), TABLE);
    robot.load("PICK", BARE);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(50);
    let mut again = Robot::from_controller(Controller::restore(robot.seat.controller.snapshot()).unwrap());
    for robot in [&mut robot, &mut again] {
        robot.advance_ms(10_000);
        assert_eq!(robot.received(Port::Ip1), b"     250.000\r");
        robot.load("AGAIN", BARE);
        assert!(read(robot, "T1 4").starts_with("250.000"));
    }
    let snapshot = serde_json::to_value(robot.seat.controller.snapshot()).unwrap();
    let refused = |change: &dyn Fn(&mut Vec<serde_json::Value>)| {
        let mut changed = snapshot.clone();
        change(changed["config"]["points"].as_array_mut().unwrap());
        let error = Controller::restore(serde_json::from_value(changed).unwrap()).unwrap_err();
        error.to_string().contains("config.points")
    };
    assert!(refused(&|points| points.push(points[0].clone())), "a name twice");
    // A work frame is what a program has given a point; the table has none.
    let frame = serde_json::json!({"name": "W", "trans": {"coords": [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]}});
    assert!(refused(&|points| points[0]["position"]["work"] = frame.clone()));
    assert!(refused(&|points| points[0]["name"] = "MOVE".into()));
}

#[test]
fn a_point_without_a_value_is_refused_with_what_to_do() {
    let mut robot = scara_of(ArmModel::thl400());
    robot.seat.controller.put_file("PICK", BARE.as_bytes()).unwrap();
    robot.connect(Port::Ip0);
    assert_eq!(robot.ask(Port::Ip0, "SL,PICK"), b"NG\r");
    let reasons = format!("{:?}", robot.outputs);
    for point in ["T1", "E1"] {
        let message = format!("no value for {point}: add it to DATA or to the taught points");
        assert!(reasons.contains(&message), "{reasons}");
    }
}

/// A robot whose option `key` has this value.
fn with_option(key: &str, value: &str) -> Robot {
    let mut config = Config::new(Dialect::Field);
    config.options.serial_pacing = false;
    let mut links = ts3100_emulator::config::LinkOptions::default();
    ts3100_emulator::config::set_option(&mut config.options, &mut links, key, value).unwrap();
    let mut robot = Robot::with(config);
    robot.connect(Port::Ip0);
    robot.connect(Port::Ip1);
    robot.panel(PanelAction::Servo(true));
    robot
}

/// What a program prints on IP1, and the alarms it leaves.
fn printed(robot: &mut Robot, body: &str, received: &[u8]) -> (String, Vec<String>) {
    robot.load("TEST", &format!("PROGRAM T\n{body}\nEND\n"));
    robot.command(Port::Ip0, "RN");
    robot.raw(Port::Ip1, received);
    robot.advance_ms(1_000);
    let text = String::from_utf8(robot.received(Port::Ip1)).unwrap();
    (text.replace(' ', "").replace('\r', "|"), robot.alarms())
}

#[test]
fn an_input_that_does_not_exist_raises_the_alarm_of_dout() {
    let alarms = |body: &str| printed(&mut with_option("scol.din_unknown", "alarm"), body, b"").1;
    let dout = alarms("DOUT(70)");
    assert_eq!(dout.len(), 1, "{dout:?}");
    for body in [
        "PRINT IP1, DIN(70)",
        "IF DIN(-999) THEN STOP",
        "WAIT DIN(1, 300)",
        "PRINT IP1, BCDIN(62, 1)",
    ] {
        assert_eq!(alarms(body), dout, "{body}");
    }
    assert_eq!(
        alarms("PRINT IP1, DIN(64), DIN(264), BCDIN(61, 1), CR"),
        Vec::<String>::new()
    );
    let zero = printed(
        &mut with_option("scol.din_unknown", "zero"),
        "PRINT IP1, DIN(70), DIN(-999), CR",
        b"",
    );
    assert_eq!(zero, ("01|".to_string(), Vec::new()));
}

#[test]
fn a_scara_counts_a_difference_of_a_thousandth_as_equal() {
    let body = "X = 1.001\nY = 1.0\nPRINT IP1, X == Y, X <> Y, X > Y, X >= Y, X <= Y, X == 1.002, X == 1.0021, CR\n\
        IF X == Y THEN GOTO SAME\nPRINT IP1, \"D\", CR\nSAME:\nPRINT IP1, 1 == 2, CR";
    let of = |robot: &mut Robot| printed(robot, body, b"").0;
    let (near, exact) = ("1001110|0|", "0111000|D|0|");
    let mut scara = scara_of(ArmModel::thl400());
    scara.connect(Port::Ip1);
    assert_eq!(of(&mut scara), near);
    assert_eq!(of(&mut with_option("channel.no_peer", "alarm")), exact);
    assert_eq!(of(&mut with_option("scol.equal_within", "0.001")), near);
    let mut scara = Config::new(Dialect::Field);
    scara.model = ArmModel::thl400();
    scara.options.equal_within = Some(0.0);
    let mut scara = Robot::with(scara);
    scara.connect(Port::Ip0);
    scara.connect(Port::Ip1);
    scara.panel(PanelAction::Servo(true));
    assert_eq!(of(&mut scara), exact);
}

// clause: INP-03 INP-14 INP-10
#[test]
fn integers_out_of_range_raise_the_overflow_alarm_on_both_sides() {
    for malformed in ["alarm", "leading-number"] {
        let read = |body: &str, received: &[u8]| {
            printed(&mut with_option("input.malformed", malformed), body, received).1
        };
        let integer = "N = 0\nINPUT IP1, N\nPRINT IP1, N, CR";
        let above = read(integer, b"2147483648\r");
        assert!(above.len() == 1 && above[0].starts_with("2-107"), "{above:?}");
        assert_eq!(read(integer, b"-2147483649\r"), above);
        assert_eq!(read(integer, b"-2147483648\r"), Vec::<String>::new());
        let real = "X = 0.0\nY = 0.0\nINPUT IP1, X, Y\nPRINT IP1, X, Y, CR";
        let beyond = read(real, b"5,1E400\r");
        assert!(beyond.len() == 1 && beyond[0].starts_with("2-107"), "{beyond:?}");
        assert_eq!(read(real, b"-2147483649,1E30\r"), Vec::<String>::new());
    }
    let mut robot = with_option("input.malformed", "leading-number");
    let (text, _) = printed(
        &mut robot,
        "X = 0.0\nINPUT IP1, X\nINPUT IP1, X\nPRINT IP1, X, CR",
        b"1E400\r7\r",
    );
    assert_eq!(text, "", "an alarm of level 2 stops after the step");
    robot.panel(PanelAction::AlarmReset);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(1_000);
    assert_eq!(
        robot.received(Port::Ip1),
        b"       7.000\r",
        "nothing of 1E400 is left"
    );
}

// clause: INP-10 S16
#[test]
fn input_makes_a_variable_that_was_never_assigned_and_what_a_stop_leaves_out_is_0() {
    let mut robot = Robot::ready("PROGRAM T\nINPUT IP1, A, B, C\nPRINT IP1, A, B, C, CR\nEND\n");
    robot.command(Port::Ip0, "RN");
    robot.raw(Port::Ip1, b"1,2.5,3\r");
    robot.advance_ms(100);
    assert_eq!(
        robot.received(Port::Ip1),
        b"           1       2.500           3\r"
    );
    robot.received(Port::Ip0);
    robot.command(Port::Ip0, "RS,PRG");
    robot.command(Port::Ip0, "RN");
    robot.raw(Port::Ip1, b"4,");
    robot.advance_ms(100);
    robot.command(Port::Ip0, "SP");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    assert_eq!(
        robot.received(Port::Ip1),
        b"           4           0           0\r"
    );
}

// clause: INP-10 INP-11 S16
#[test]
fn input_by_do_makes_its_variable_waits_for_it_and_is_cut_short_by_a_stop() {
    let mut robot = Robot::ready("GLOBAL\nN = 7\nEND\nPROGRAM T\nMINE = 1\nPRINT IP1, N, CR\nEND\n");
    assert_eq!(robot.ask(Port::Ip0, "DO,INPUT IP1, FRESH, N, MINE"), b"OK\r");
    robot.advance_ms(500);
    assert_eq!(robot.ask(Port::Ip0, "DO,DELAY 0"), b"NG\r", "it waits");
    let mut again = Robot::from_controller(Controller::restore(robot.seat.controller.snapshot()).unwrap());
    for robot in [&mut robot, &mut again] {
        robot.raw(Port::Ip1, b"2.5,");
        robot.advance_ms(100);
        assert_eq!(
            Controller::restore(robot.seat.controller.snapshot()).unwrap(),
            robot.seat.controller
        );
        robot.raw(Port::Ip1, b"12,3\r");
        robot.advance_ms(500);
        assert_eq!(robot.alarms(), Vec::<String>::new());
        robot.received(Port::Ip0);
        assert_eq!(read(robot, "N 0"), "12");
        assert_eq!(read(robot, "FRESH -1"), "NG", "it was the statement's own");
        assert_eq!(robot.ask(Port::Ip0, "DO,INPUT IP1, FRESH, N"), b"OK\r");
        robot.raw(Port::Ip1, b"4,");
        robot.advance_ms(100);
        robot.command(Port::Ip0, "EC,BREAK");
        robot.advance_ms(500);
        robot.received(Port::Ip0);
        assert_eq!(read(robot, "N 0"), "0", "what has not come is 0");
        assert_eq!(robot.ask(Port::Ip0, "DO,PRINT IP1, FRESH"), b"NG\r");
    }
}

#[test]
fn no_coordinate_is_read_that_a_real_cannot_hold() {
    let far = "GLOBAL\nX = 1.0\nEND\nPROGRAM P\nBASE = TRANS(3.4E38, 3.4E38, 0, 0, 0, 45)\nX = HERE.X\nEND\n";
    let mut robot = Robot::ready(far);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    let alarms = robot.alarms();
    assert!(alarms.len() == 1 && alarms[0].starts_with("2-107"), "{alarms:?}");
    let controller = &robot.seat.controller;
    assert_eq!(&Controller::restore(controller.snapshot()).unwrap(), controller);
}

const DATA: &str = "GLOBAL\nN = 1\nM = 2\nDIM LOG(2) AS INTEGER\nDIM FIRST(1) AS INTEGER\nFIRST(0) = 3\nEND\n\
    PROGRAM P\nN = N + 10\nM = 20\nH.Z = 150\nLOG(1) = LOG(1) + 1\nFIRST(0) = 9\n@\nPRINT IP1, N, LOG(1), CR\nEND\n\
    DATA\nPOINT H=400,0,200/\nEND\n";

// clause: CMD-MW-02
#[test]
fn restore_writes_the_data_back_into_the_file() {
    let (old, new) = ("N = 1\nM = 2\n", "N = 11\nM = 20\n");
    let height = |text: &str| text.replace("H=400,0,200/", "H=400,0,150,0,0,0,0,0/");
    for (statement, restored) in [
        (
            "RESTORE",
            height(&DATA.replace(old, new).replace("FIRST(0) = 3", "FIRST(0) = 9")),
        ),
        ("RESTORE N, H", height(&DATA.replace(old, "N = 11\nM = 2\n"))),
        ("IF N > 99 THEN RESTORE", DATA.to_string()),
    ] {
        let mut robot = Robot::ready(&DATA.replace('@', statement));
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(100);
        assert_eq!(robot.alarms(), Vec::<String>::new());
        assert_eq!(
            robot.received(Port::Ip1),
            b"          11           1\r",
            "{statement}"
        );
        let file = robot
            .seat
            .controller
            .files()
            .find(|(name, _)| *name == "TEST")
            .unwrap();
        let text = String::from_utf8(file.1.to_vec()).unwrap();
        assert_eq!(text, restored.replace('@', statement), "{statement}");
        // A start takes what the file says, but for an array without an initial value.
        robot.received(Port::Ip0);
        robot.command(Port::Ip0, "RS,PRG");
        robot.received(Port::Ip0);
        let n = if restored.contains("N = 11") { "11" } else { "1" };
        assert_eq!(read(&mut robot, "N 0"), n, "{statement}");
        assert_eq!(read(&mut robot, "LOG(1) 5"), "1", "{statement}");
        let first = if restored.contains("FIRST(0) = 3") {
            "3"
        } else {
            "9"
        };
        assert_eq!(read(&mut robot, "FIRST(0) 5"), first, "{statement}");
        // The machine goes on in the new file.
        assert_eq!(
            Controller::restore(robot.seat.controller.snapshot()).unwrap(),
            robot.seat.controller
        );
        robot.load("TEST", &text);
        assert_eq!(
            read(&mut robot, "LOG(1) 5"),
            "0",
            "selected anew: nothing is kept"
        );
    }
}

#[test]
fn restore_by_do_and_by_a_monitor_is_the_same_and_what_cannot_be_restored_is_an_alarm() {
    let mut robot = Robot::ready(&DATA.replace('@', "N = 5"));
    assert_eq!(robot.ask(Port::Ip0, "MW,0 N 0 7"), b"OK\r");
    assert_eq!(robot.ask(Port::Ip0, "DO,RESTORE"), b"OK\r");
    robot.advance_ms(300);
    assert!(stored(&robot).contains("N = 7\nM = 2"), "{}", stored(&robot));
    assert_eq!(robot.ask(Port::Ip0, "DO,RESTORE N, NOPE"), b"NG\r");

    let watching = "GLOBAL\nN = 1\nEND\nPROGRAM P\nON N > 2 DO RESTORE\nN = 3\nDELAY 1\nEND\n";
    let mut robot = Robot::ready(watching);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(500);
    assert!(stored(&robot).contains("N = 3\nEND"), "{}", stored(&robot));
    assert_eq!(
        Controller::restore(robot.seat.controller.snapshot()).unwrap(),
        robot.seat.controller
    );

    let mut robot = Robot::new(Dialect::Field);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot.command(Port::Ip0, "DO,RESTORE");
    robot.advance_ms(300);
    let alarms = robot.alarms();
    assert!(alarms.len() == 1 && alarms[0].starts_with("2-112"), "{alarms:?}");
}
