//! Tests of serial lines when the controller is replaced.

use super::*;

/// Address of a serial line over TCP.
fn serial_address(driver: &Driver, port: Port) -> SocketAddr {
    let endpoint = driver.serial_endpoints(FIRST).remove(&port);
    let Some(SerialEndpoint::Rfc2217(address) | SerialEndpoint::Tcp(address)) = endpoint else {
        panic!("{endpoint:?}");
    };
    address
}

#[test]
fn the_host_of_a_serial_line_stays_connected_when_a_snapshot_brings_the_power_back() {
    single_threaded().block_on(async {
        let (mut driver, _requests) = open_with(|setup| {
            let line = SerialEndpoint::Tcp(([127, 0, 0, 1], 0).into());
            setup.serial.insert(Port::Host, line);
        });
        let peer = |driver: &Driver| {
            driver.world[FIRST]
                .seat
                .controller
                .peer(Port::Host)
                .map(str::to_owned)
        };
        let _host = TcpStream::connect(serial_address(&driver, Port::Host)).unwrap();
        serve_until(&mut driver, |driver| peer(driver).is_some()).await;
        let (connected, next) = (peer(&driver), driver.world[FIRST].seat.controller.clone());
        driver.feed(FIRST, Input::by_owner(Action::PowerOff));
        assert_eq!(peer(&driver), None);
        restore(&mut driver, next).await;
        assert_eq!(peer(&driver), connected);
    });
}

#[test]
fn a_serial_line_has_the_settings_of_the_snapshot_that_is_restored() {
    single_threaded().block_on(async {
        let (mut driver, _requests) = open_with(|setup| {
            let line = SerialEndpoint::Rfc2217(([127, 0, 0, 1], 0).into());
            setup.serial.insert(Port::Host, line);
        });
        // What the access server answers to a client that asks for the speed.
        let told = |speed: u32| [&[255, 250, 44, 101], &speed.to_be_bytes()[..], &[255, 240]].concat();
        let ask = move |host: &mut TcpStream, speed| {
            exchange(host, &[255, 250, 44, 1, 0, 0, 0, 0, 255, 240], &told(speed));
        };
        let address = serial_address(&driver, Port::Host);
        let mut host = serve_while(&mut driver, move |_| {
            let mut host = TcpStream::connect(address).unwrap();
            ask(&mut host, 9_600);
            host
        })
        .await;
        let parameters = driver.world[FIRST]
            .seat
            .controller
            .drive()
            .get("USER.PAR")
            .unwrap();
        let parameters = String::from_utf8(parameters.to_vec()).unwrap();
        let parameters = parameters.replace("{HOST} = 9600", "{HOST} = 19200").into_bytes();
        let files = vec![("USER.PAR".to_owned(), parameters)];
        let next = Controller::new(Config::new(Dialect::Field), files).unwrap();
        restore(&mut driver, next).await;
        serve_while(&mut driver, move |_| ask(&mut host, 19_200)).await;
    });
}
