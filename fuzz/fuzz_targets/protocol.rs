//! Arbitrary bytes on every port, cut anywhere, with time in between, connections that come and go, and everything one
//! can do at the panel. The controller never panics, never hangs, never grows without bound, and still answers a
//! host afterwards.
#![no_main]

use libfuzzer_sys::fuzz_target;
use ts3100_controller::{Input, Panel, Port};
use ts3100_fuzz::{Cell, Choices};

/// Things that happen in one run.
const EVENTS: u32 = 300;
const PROGRAM: &[u8] =
    b"GLOBAL\rN=0\rEND\rPROGRAM M\rX=0.0\rL:\rINPUT IP1,N,X\rPRINT IP1,N,X,CR\rGOTO L\rEND\rDATA\r\
    POINT P1=400,0,200/\rEND\r";

fuzz_target!(|data: &[u8]| {
    let mut choices = Choices(data);
    let mut cell = Cell::new(choices.byte() & 1 == 0);
    let stored = cell.controller.put_file("TEST", PROGRAM);
    assert!(stored.is_ok());
    for _ in 0..EVENTS {
        if choices.is_over() {
            break;
        }
        cell.act(&mut choices);
    }
    // Texts left open run out, and a new host is served.
    cell.pass(30_000);
    cell.feed(Input::Disconnected { port: Port::Ip0 });
    cell.feed(Input::Panel(Panel::PowerCycle));
    let port = Port::Ip0;
    let peer = String::from("fresh");
    cell.feed(Input::Connected { port, peer });
    let bytes = b"\x02CA\r\x03".to_vec();
    cell.feed(Input::Received { port, bytes });
});
