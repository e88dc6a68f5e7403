//! Pictures for tev, on this machine or another one: whatever an engine has, sent as it comes.
//!
//! tev (<https://github.com/Tom94/tev>) listens for packets: a length of four bytes that counts itself, a byte for the
//! operation, and what it takes, all little-endian. A picture is created once, and its values are replaced at each news.

use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use impasto_viewer::engine::{Engine, News, Picture, Problem, State};

/// Where tev listens unless it is told otherwise.
pub const PORT: u16 = 14158;

/// Operations of the protocol.
const CLOSE: u8 = 2;
const CREATE: u8 = 4;
const UPDATE: u8 = 6;

/// How long is waited for tev to answer, and to take a packet.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often is looked whether anybody wants an end.
const LOOK: Duration = Duration::from_millis(100);
/// How long after a failure is tried again.
const AGAIN: Duration = Duration::from_secs(1);

/// A tev that listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    host: String,
    port: u16,
}

impl Address {
    /// Reads `HOST:PORT`, `HOST`, or `[v6]:PORT`.
    ///
    /// # Errors
    /// What is wrong with it, and what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        const EXPECTED: &str = "expected HOST or HOST:PORT, as in `localhost:14158`";
        let (host, port) = match text.rsplit_once(':') {
            Some((host, port)) if !host.ends_with(':') && !host.is_empty() => {
                let port = port.parse().map_err(|_| EXPECTED.to_owned())?;
                (host, port)
            }
            _ => (text, PORT),
        };
        let host = host.trim_start_matches('[').trim_end_matches(']');
        let lacks_host = text.starts_with(':') && !text.starts_with("::");
        if host.is_empty() || lacks_host || host.contains(char::is_whitespace) {
            return Err(EXPECTED.into());
        }
        Ok(Self {
            host: host.to_owned(),
            port,
        })
    }

    fn connect(&self) -> io::Result<TcpStream> {
        let mut last = io::Error::other("the name has no address");
        for address in (self.host.as_str(), self.port).to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(PATIENCE))?;
                    stream.set_nodelay(true)?;
                    return Ok(stream);
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.host.contains(':') {
            write!(f, "[{}]:{}", self.host, self.port)
        } else {
            write!(f, "{}:{}", self.host, self.port)
        }
    }
}

/// What there is to tell whoever sends pictures.
pub enum Told<'a> {
    /// So many samples of a pixel are sent.
    Sent(&'a Picture),
    /// The files have errors; the last picture stays.
    Problems(&'a [Problem]),
    /// tev is not there (any more): why. It is tried again.
    Away(&'a io::Error),
}

/// Sends the pictures of `engine` until `stop` says so.
///
/// # Errors
/// If the engine cannot go on.
pub fn send(
    engine: &dyn Engine,
    address: &Address,
    stop: &dyn Fn() -> bool,
    tell: &mut dyn FnMut(Told<'_>),
) -> Result<(), String> {
    let (wake, woken) = channel();
    engine.on_news(Box::new(move || {
        // Nobody waits for a channel that is gone.
        let _ = wake.send(());
    }));
    let mut connection = Connection::new(address.clone());
    let mut problems = None;
    loop {
        if stop() {
            return Ok(());
        }
        let news = engine.news();
        if let State::Failed(why) = &news.state {
            return Err(why.clone());
        }
        let is_new = problems
            .as_ref()
            .is_none_or(|p| !std::sync::Arc::ptr_eq(p, &news.problems));
        if is_new {
            if !news.problems.is_empty() {
                tell(Told::Problems(&news.problems));
            }
            problems = Some(news.problems.clone());
        }
        let wait = match connection.show(&news) {
            Ok(Some(picture)) => {
                tell(Told::Sent(picture));
                LOOK
            }
            Ok(None) => LOOK,
            Err(error) => {
                tell(Told::Away(&error));
                AGAIN
            }
        };
        match woken.recv_timeout(wait) {
            Ok(()) => woken.try_iter().for_each(drop),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
    }
}

/// A connection to a tev, and what it shows.
struct Connection {
    address: Address,
    stream: Option<TcpStream>,
    /// The number of the picture that it shows.
    shown: Option<u64>,
    /// What was created: name, size and channels.
    created: Option<(String, [u32; 2], Vec<String>)>,
}

impl Connection {
    fn new(address: Address) -> Self {
        Self {
            address,
            stream: None,
            shown: None,
            created: None,
        }
    }

    /// Sends the picture of the news, if it is another one.
    fn show<'n>(&mut self, news: &'n News) -> io::Result<Option<&'n Picture>> {
        let Some(picture) = news.picture.as_deref() else {
            return Ok(None);
        };
        if self.shown == Some(picture.number) {
            return Ok(None);
        }
        let sent = self.replace(&news.project.name, picture);
        if sent.is_err() {
            *self = Self::new(self.address.clone());
        }
        sent?;
        self.shown = Some(picture.number);
        Ok(Some(picture))
    }

    fn replace(&mut self, name: &str, picture: &Picture) -> io::Result<()> {
        let name = match name {
            "" => "impasto".to_owned(),
            // Names end in a zero.
            name => name.replace('\0', ""),
        };
        let (channels, values) = planes(picture);
        let size = [picture.width, picture.height];
        let wanted = (name.clone(), size, channels.clone());
        if self.created.as_ref() != Some(&wanted) {
            if let Some((old, ..)) = self.created.take() {
                self.packet(Packet::new(CLOSE).text(&old))?;
            }
            let mut packet = Packet::new(CREATE).byte(0).text(&name);
            for side in size {
                packet = packet.int(side as i32);
            }
            packet = packet.int(channels.len() as i32);
            let packet = channels.iter().fold(packet, |p, channel| p.text(channel));
            self.packet(packet)?;
            self.created = Some(wanted);
        }
        let mut packet = Packet::new(UPDATE).byte(0).text(&name);
        packet = packet.int(channels.len() as i32);
        packet = channels.iter().fold(packet, |p, channel| p.text(channel));
        packet = packet.int(0).int(0);
        packet = packet.int(size[0] as i32).int(size[1] as i32);
        let pixels = i64::from(size[0]) * i64::from(size[1]);
        for index in 0..channels.len() as i64 {
            packet = packet.long(index * pixels);
        }
        for _ in &channels {
            packet = packet.long(1);
        }
        self.packet(packet.floats(&values))
    }

    fn packet(&mut self, packet: Packet) -> io::Result<()> {
        let bytes = packet.finish()?;
        let stream = match &mut self.stream {
            Some(stream) => stream,
            none => none.insert(self.address.connect()?),
        };
        stream.write_all(&bytes)
    }
}

/// The names of channels, and their values, one channel after the other.
fn planes(picture: &Picture) -> (Vec<String>, Vec<f32>) {
    let mut channels: Vec<String> = ["R", "G", "B"].map(str::to_owned).to_vec();
    let mut values = Vec::new();
    for channel in 0..3 {
        values.extend(picture.pixels.iter().map(|pixel| pixel[channel]));
    }
    for layer in &picture.layers {
        let count = layer.channels as usize;
        let letters: &[&str] = match count {
            1 => &[""],
            2 => &[".U", ".V"],
            3 => &[".R", ".G", ".B"],
            _ => &[".R", ".G", ".B", ".A"],
        };
        for (channel, letter) in letters.iter().enumerate() {
            channels.push(format!("{}{letter}", layer.name));
            let own = layer.values.iter().skip(channel).step_by(count.max(1));
            values.extend(own);
        }
    }
    // A layer of another size would be read as the next one.
    let pixels = picture.pixels.len();
    values.resize(channels.len() * pixels, 0.0);
    (channels, values)
}

/// A packet under construction.
struct Packet(Vec<u8>);

impl Packet {
    fn new(operation: u8) -> Self {
        Self(vec![0, 0, 0, 0, operation])
    }

    fn byte(mut self, byte: u8) -> Self {
        self.0.push(byte);
        self
    }

    fn int(mut self, int: i32) -> Self {
        self.0.extend(int.to_le_bytes());
        self
    }

    fn long(mut self, long: i64) -> Self {
        self.0.extend(long.to_le_bytes());
        self
    }

    fn text(mut self, text: &str) -> Self {
        self.0.extend(text.bytes());
        self.byte(0)
    }

    fn floats(mut self, values: &[f32]) -> Self {
        self.0.extend(values.iter().flat_map(|x| x.to_le_bytes()));
        self
    }

    fn finish(mut self) -> io::Result<Vec<u8>> {
        let length = u32::try_from(self.0.len())
            .map_err(|_| io::Error::other("the picture is too large for tev's protocol"))?;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        Ok(self.0)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::net::TcpListener;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    use impasto_viewer::engine::{Answer, LayerKind, Order, PictureLayer, Project};

    use super::*;

    #[test]
    fn addresses_are_read() {
        for (text, shown) in [
            ("localhost", "localhost:14158"),
            ("10.0.0.1:99", "10.0.0.1:99"),
            ("[::1]:99", "[::1]:99"),
        ] {
            let address = Address::parse(text).expect(text);
            assert_eq!(address.to_string(), shown);
        }
        for text in ["", ":", "a:b", "a b", "host:99999"] {
            assert!(Address::parse(text).is_err(), "{text}");
        }
    }

    /// An engine with one picture.
    struct Still(Arc<Picture>);

    impl Engine for Still {
        fn order(&self, _: Order) {}

        fn news(&self) -> News {
            News {
                state: State::Done,
                picture: Some(self.0.clone()),
                project: Arc::new(Project {
                    name: "still".into(),
                    ..Project::default()
                }),
                ..News::default()
            }
        }

        fn answers(&self) -> Vec<Answer> {
            Vec::new()
        }

        fn on_news(&self, _: Box<dyn Fn() + Send + Sync>) {}
    }

    fn packet(stream: &mut TcpStream) -> Vec<u8> {
        let mut length = [0; 4];
        stream.read_exact(&mut length).expect("a length");
        let mut rest = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut rest).expect("a packet");
        rest
    }

    #[test]
    fn a_picture_is_created_and_filled() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let port = listener.local_addr().expect("an address").port();
        let picture = Picture {
            number: 7,
            width: 2,
            height: 1,
            pixels: Arc::new(vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]),
            layers: vec![PictureLayer {
                name: "depth".into(),
                about: String::new(),
                kind: LayerKind::Number,
                channels: 1,
                values: Arc::new(vec![7.0, 8.0]),
            }],
            ..Picture::default()
        };
        let is_over = Arc::new(AtomicBool::new(false));
        let over = is_over.clone();
        let sender = std::thread::spawn(move || {
            let engine = Still(Arc::new(picture));
            let address = Address::parse(&format!("127.0.0.1:{port}")).expect("an address");
            let stop = || over.load(Ordering::Relaxed);
            send(&engine, &address, &stop, &mut |_| ())
        });
        let (mut stream, _) = listener.accept().expect("it connects");
        let created = packet(&mut stream);
        let mut expected = vec![CREATE, 0];
        expected.extend(b"still\0");
        expected.extend([2, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0, 0]);
        expected.extend(b"R\0G\0B\0depth\0");
        assert_eq!(created, expected);
        let filled = packet(&mut stream);
        let floats: Vec<f32> = filled[filled.len() - 32..]
            .chunks(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        assert_eq!(floats, [1.0, 4.0, 2.0, 5.0, 3.0, 6.0, 7.0, 8.0]);
        assert_eq!(filled[0], UPDATE);
        is_over.store(true, Ordering::Relaxed);
        sender.join().expect("no panic").expect("no error");
    }
}
