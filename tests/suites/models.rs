//! The optional arms with a data sheet (decision T18): the numbers of the sheets, as a host finds them. The files they are
//! shipped in are compared with the built-in models in the emulator's `config::model`.

use crate::extensions::{scara_of, values};
use ts3100_controller::Port;
use ts3100_controller::model::ArmModel;

/// The alarms of one statement of DO, which has come to its end.
fn alarms(model: &ArmModel, statement: &str) -> Vec<String> {
    let mut robot = scara_of(model.clone());
    robot.command(Port::Ip0, &format!("DO,{statement}"));
    robot.advance_ms(20_000);
    robot.alarms()
}

/// Each axis goes as far as it is said to, and no further.
fn has_limits(model: &ArmModel, limits: &[(usize, [f64; 2])]) {
    for (axis, ends) in limits {
        let [least, most] = ends;
        for value in ends {
            assert!(alarms(model, &format!("MOVEA {axis}, {value}")).is_empty());
        }
        for beyond in [least - 0.1, most + 0.1] {
            let found = alarms(model, &format!("MOVEA {axis}, {beyond}"));
            assert_eq!(found, ["8-035"], "{} axis {axis}: {beyond}", model.name);
        }
    }
}

fn reaches(model: &ArmModel, far: f64) {
    assert!(alarms(model, &format!("MOVE POINT({far},0,0)")).is_empty());
    let beyond = format!("MOVE POINT({},0,0)", far + 0.1);
    assert_eq!(alarms(model, &beyond), ["8-035"], "{}", model.name);
}

// clause: T18 J8
#[test]
fn the_thl300_has_the_links_and_the_third_axis_of_its_drawing() {
    let model = ArmModel::by_name("tsl3000-thl300").unwrap();
    reaches(&model, 300.0);
    has_limits(&model, &[(3, [0.0, 160.0])]);
    // The second axis straight across: the links are 125 and 175 mm, and Z of the world is axis 3.
    let mut robot = scara_of(model);
    for statement in ["MOVEA 1, 0", "MOVEA 2, 90", "MOVEA 3, 48"] {
        robot.command(Port::Ip0, &format!("DO,{statement}"));
        robot.advance_ms(5_000);
    }
    let world = values(&mut robot, "PR,4");
    for (found, expected) in world.iter().zip([125.0, 175.0, 48.0]) {
        assert!((found - expected).abs() < 2e-3, "{world:?}");
    }
}

// clause: T18 I19
#[test]
fn the_scara_600_has_the_limits_and_speeds_of_its_sheet() {
    let model = ArmModel::by_name("scara-600").unwrap();
    reaches(&model, 600.0);
    let limits = [
        (1, [-125.0, 125.0]),
        (2, [-145.0, 145.0]),
        (3, [0.0, 150.0]),
        (4, [-360.0, 360.0]),
    ];
    has_limits(&model, &limits);
    assert_eq!(alarms(&model, "MOVEA 5, 0"), ["8-035"], "it has four axes");
    let speeds: Vec<f64> = model.axes.iter().map(|axis| axis.max_speed).collect();
    assert_eq!(speeds, [450.0, 450.0, 2000.0, 1700.0]);
    let mut robot = scara_of(model);
    for statement in ["MOVEA 1, 0", "MOVEA 2, 90"] {
        robot.command(Port::Ip0, &format!("DO,{statement}"));
        robot.advance_ms(5_000);
    }
    let world = values(&mut robot, "PR,4");
    assert!((world[0] - 300.0).abs() < 2e-3 && (world[1] - 300.0).abs() < 2e-3);
}

// clause: T18
#[test]
fn a_load_of_10_kg_is_the_most_the_scara_600_carries() {
    let model = ArmModel::by_name("scara-600").unwrap();
    for (mass, expected) in [("10", &[][..]), ("10.1", &["4-102"])] {
        let statement = format!("MOVEA 1, 10 WITH PAYLOAD={{{mass},0}}");
        assert_eq!(alarms(&model, &statement), expected, "{mass} kg");
    }
}
