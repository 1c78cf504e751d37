//! MOVEJ on both kinds of arm (decisions T11 and T24): which way its three distances make the tool point go, and which
//! distances fit. The planner's own tests are in `motion::tests::arch` of the controller.

use crate::extensions::{scara, six_axis, values};
use ts3100_controller::Port;
use ts3100_tests::Robot;

/// Between two looks at the arm, ms.
const LOOK: u64 = 5;
/// Rounding of what PR shows, mm.
const ROUNDING: f64 = 2e-3;

/// An arm with the start and the end of its arch, as positions and as the statement writes the end.
struct Case {
    robot: fn() -> Robot,
    start: [f64; 3],
    end: [f64; 3],
    target: &'static str,
    with: &'static str,
}

/// Both kinds of arm, each with a start below and above its end, and with a work coordinate system for the motion.
const CASES: [Case; 6] = [
    Case {
        robot: six_axis,
        start: [400.0, -100.0, 200.0],
        end: [400.0, 100.0, 230.0],
        target: "POINT(400,100,230)",
        with: "",
    },
    Case {
        robot: six_axis,
        start: [400.0, -100.0, 230.0],
        end: [400.0, 100.0, 200.0],
        target: "POINT(400,100,200)",
        with: "",
    },
    Case {
        robot: six_axis,
        start: [400.0, -100.0, 200.0],
        end: [400.0, 100.0, 230.0],
        target: "POINT(0,0,10)",
        with: ", WORK=TRANS(400,100,220)",
    },
    Case {
        robot: scara,
        start: [250.0, -100.0, -40.0],
        end: [200.0, 100.0, -20.0],
        target: "POINT(200,100,-20)",
        with: "",
    },
    Case {
        robot: scara,
        start: [250.0, -100.0, -20.0],
        end: [200.0, 100.0, -40.0],
        target: "POINT(200,100,-40)",
        with: "",
    },
    Case {
        robot: scara,
        start: [250.0, -100.0, -40.0],
        end: [200.0, 100.0, -20.0],
        target: "POINT(0,0,-10)",
        with: ", WORK=TRANS(200,100,-10)",
    },
];

impl Case {
    /// The arm at rest at the start.
    fn at_start(&self) -> Robot {
        let mut robot = (self.robot)();
        let [x, y, z] = self.start;
        robot.command(Port::Ip0, &format!("DO,MOVE POINT({x},{y},{z})"));
        robot.advance_ms(10_000);
        robot
    }

    fn statement(&self, [retreat, first, last]: [f64; 3]) -> String {
        let Case { target, with, .. } = self;
        format!("DO,MOVEJ {target} POINT({retreat},{first},{last}) WITH SPEED=20{with}")
    }

    /// The places of the tool point in the world on the way, and the alarms.
    fn run(&self, distances: [f64; 3]) -> (Vec<[f64; 3]>, Vec<String>) {
        let mut robot = self.at_start();
        robot.command(Port::Ip0, &self.statement(distances));
        let place = |robot: &mut Robot| {
            let values = values(robot, "PR,4");
            [values[0], values[1], values[2]]
        };
        let places = (0..800).map(|_| {
            robot.advance_ms(LOOK);
            place(&mut robot)
        });
        (places.collect(), robot.alarms())
    }

    /// The height of the arch, and how far up and down the way goes.
    fn heights(&self, retreat: f64) -> (f64, f64, f64) {
        let top = self.start[2].max(self.end[2]) + retreat;
        (top, top - self.start[2], top - self.end[2])
    }
}

fn flat(one: [f64; 3], other: [f64; 3]) -> f64 {
    (one[0] - other[0]).hypot(one[1] - other[1])
}

// clause: T11 T24 T27 L69 L80
#[test]
fn the_arch_retreats_over_the_higher_end_and_goes_its_single_axis_ways_alone() {
    for case in &CASES {
        let [retreat, first, last] = [40.0, 20.0, 15.0];
        let (places, alarms) = case.run([retreat, first, last]);
        assert!(alarms.is_empty(), "{} {alarms:?}", case.target);
        let (top, ..) = case.heights(retreat);
        let highest = places.iter().map(|place| place[2]).fold(f64::MIN, f64::max);
        assert!(
            (highest - top).abs() < 0.5,
            "{}: {highest}, not {top}",
            case.target
        );
        let end = places.last().copied().unwrap();
        assert!(flat(end, case.end) < ROUNDING && (end[2] - case.end[2]).abs() < ROUNDING);
        let (mut rising, mut sinking, mut overlaps) = (0, 0, 0);
        for place in places {
            let (from_start, to_end) = (flat(place, case.start), flat(place, case.end));
            if from_start > ROUNDING && to_end > ROUNDING {
                assert!(place[2] > case.start[2] + first - 0.5 || to_end < from_start);
                assert!(place[2] > case.end[2] + last - 0.5 || to_end > from_start);
                overlaps += u32::from(place[2] < top - 1.0);
            }
            rising += u32::from(from_start < ROUNDING && place[2] > case.start[2] + 1.0);
            sinking += u32::from(to_end < ROUNDING && place[2] > case.end[2] + 1.0);
        }
        assert!(
            rising > 2 && sinking > 2 && overlaps > 2,
            "{rising} {sinking} {overlaps}"
        );
    }
}

// clause: T11 T8 T27
#[test]
fn distances_fit_from_0_to_the_height_of_the_arch_and_others_are_2_104() {
    for case in &CASES {
        let (_, up, down) = case.heights(40.0);
        for (distances, fits) in [
            ([40.0, up, down], true),
            ([40.0, 0.0, 0.0], true),
            ([0.0, 0.0, 0.0], true),
            ([40.0, up + 0.1, down], false),
            ([40.0, up, down + 0.1], false),
            ([-0.1, 0.0, 0.0], false),
            ([40.0, -0.1, 0.0], false),
            ([40.0, 0.0, -0.1], false),
        ] {
            let mut robot = case.at_start();
            robot.command(Port::Ip0, &case.statement(distances));
            robot.advance_ms(10_000);
            let expected: &[&str] = if fits { &[] } else { &["2-104"] };
            assert_eq!(robot.alarms(), expected, "{} {distances:?}", case.target);
            assert_eq!(robot.total(Port::Ip0)[0], 1, "servo power stays on");
        }
    }
}

// clause: T11 T8
#[test]
fn after_distances_that_do_not_fit_a_start_goes_on_with_the_next_statement() {
    let mut robot = scara();
    robot.connect(Port::Ip1);
    robot.load(
        "P",
        "PROGRAM P\nMOVEJ POINT(250,100,0,0,0) POINT(20,-1,20)\nPRINT IP1,\"X\"\nEND\n",
    );
    robot.command(Port::Ip0, "SL,P");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(1_000);
    assert_eq!(robot.alarms(), ["2-104"]);
    assert_eq!(robot.received(Port::Ip1), b"");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Ip1), b"X");
    assert_eq!(robot.alarms(), ["2-104"]);
}

// clause: T11
#[test]
fn without_overlap_the_way_across_is_level_and_with_full_overlap_it_is_quickest() {
    for case in &CASES {
        let (top, up, down) = case.heights(40.0);
        let (places, _) = case.run([40.0, up, down]);
        for place in &places {
            let is_between = flat(*place, case.start) > ROUNDING && flat(*place, case.end) > ROUNDING;
            assert!(!is_between || (place[2] - top).abs() < ROUNDING, "{place:?}");
        }
        let looks = |distances| {
            let (places, _) = case.run(distances);
            let end = places.last().copied();
            places.iter().take_while(|place| Some(**place) != end).count()
        };
        assert!(looks([40.0, 0.0, 0.0]) < looks([40.0, 20.0, 20.0]));
        assert!(looks([40.0, 20.0, 20.0]) < looks([40.0, up, down]));
    }
}
