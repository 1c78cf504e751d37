//! Characters with a parity or framing error, as a terminal driver marks them (PARMRK): `FF 00` and the character as
//! read; a good `FF` stands twice. What becomes of them is the controller's.

/// What stands in what a port delivers, in its order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Marked {
    /// Good characters.
    Good(Vec<u8>),
    /// Bad ones, as read.
    Bad(Vec<u8>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum State {
    #[default]
    Plain,
    Mark,
    Bad,
}

/// Takes the marks out of a stream, however it is cut.
#[derive(Debug, Default)]
pub(super) struct Marks {
    state: State,
}

impl Marks {
    /// What these bytes complete. On a system whose ports mark nothing every byte is good.
    pub(super) fn push(&mut self, bytes: &[u8]) -> Vec<Marked> {
        if !cfg!(unix) {
            return vec![Marked::Good(bytes.to_vec())];
        }
        let mut found = Vec::new();
        for &byte in bytes {
            self.state = match (self.state, byte) {
                (State::Plain, 0xFF) => State::Mark,
                (State::Mark, 0) => State::Bad,
                (State::Plain | State::Mark, byte) => {
                    put(&mut found, byte, true);
                    State::Plain
                }
                (State::Bad, byte) => {
                    put(&mut found, byte, false);
                    State::Plain
                }
            };
        }
        found
    }
}

fn put(found: &mut Vec<Marked>, byte: u8, good: bool) {
    match (found.last_mut(), good) {
        (Some(Marked::Good(bytes)), true) | (Some(Marked::Bad(bytes)), false) => bytes.push(byte),
        (_, true) => found.push(Marked::Good(vec![byte])),
        (_, false) => found.push(Marked::Bad(vec![byte])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_taken_out_wherever_the_stream_is_cut() {
        let stream = [b'a', 0xFF, 0xFF, 0xFF, 0, b'x', 0xFF, 0, 0xFF, b'b', 0];
        let expected = [
            Marked::Good(vec![b'a', 0xFF]),
            Marked::Bad(vec![b'x', 0xFF]),
            Marked::Good(vec![b'b', 0]),
        ];
        for cut in 0..=stream.len() {
            let mut marks = Marks::default();
            let mut found: Vec<Marked> = Vec::new();
            let (first, second) = stream.split_at(cut);
            for part in [marks.push(first), marks.push(second)].concat() {
                match (found.last_mut(), part) {
                    (Some(Marked::Good(bytes)), Marked::Good(more))
                    | (Some(Marked::Bad(bytes)), Marked::Bad(more)) => bytes.extend(more),
                    (_, part) => found.push(part),
                }
            }
            assert_eq!(found, expected, "{cut}");
        }
    }
}
