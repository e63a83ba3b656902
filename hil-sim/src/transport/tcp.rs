//! TCP, without delay: a frame is smaller than a segment and must not wait for the next.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::time::Duration;

use super::{Stream, ended, is_timeout};
use crate::session::SessionError;

/// Longest wait for a connection to be accepted by the peer.
const CONNECT_PATIENCE: Duration = Duration::from_secs(5);

/// A connection.
pub struct Tcp {
    stream: TcpStream,
    patience: Option<Duration>,
}

impl Tcp {
    /// Connects to `host:port`.
    ///
    /// # Errors
    /// A sentence with the address.
    pub fn connect(address: &str) -> Result<Self, SessionError> {
        let place = format!("tcp:{address}");
        let open = |e: &io::Error| SessionError::Open { place: place.clone(), reason: reason(e) };
        let resolved: Vec<SocketAddr> = address.to_socket_addrs().map_err(|e| open(&e))?.collect();
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
        for socket in resolved {
            match TcpStream::connect_timeout(&socket, CONNECT_PATIENCE) {
                Ok(stream) => return Self::new(stream).map_err(|e| open(&e)),
                Err(e) => last = e,
            }
        }
        Err(open(&last))
    }

    fn new(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        Ok(Self { stream, patience: None })
    }
}

impl Stream for Tcp {
    fn read_some(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        // The system takes a timeout of zero for "for ever".
        let patience = patience.max(Duration::from_millis(1));
        if self.patience != Some(patience) {
            self.stream.set_read_timeout(Some(patience))?;
            self.patience = Some(patience);
        }
        match self.stream.read(buffer) {
            Ok(0) => Err(ended()),
            Ok(n) => Ok(n),
            Err(e) if is_timeout(&e) => Ok(0),
            Err(e) => Err(e),
        }
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.write_all(bytes)
    }
}

/// A port to which peers connect.
pub struct Listener {
    listener: TcpListener,
}

impl Listener {
    /// Listens at `host:port`; port 0 takes a free one.
    ///
    /// # Errors
    /// A sentence with the address: in use, not allowed, not ours.
    pub fn bind(address: &str) -> Result<Self, SessionError> {
        TcpListener::bind(address)
            .map(|listener| Self { listener })
            .map_err(|e| SessionError::Open { place: format!("tcp:{address}"), reason: reason(&e) })
    }

    /// The address with the port that was chosen.
    ///
    /// # Errors
    /// The system does not say.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Waits for a peer.
    ///
    /// # Errors
    /// Of the system.
    pub fn accept(&self) -> io::Result<Tcp> {
        Tcp::new(self.listener.accept()?.0)
    }
}

/// A network error in the words of a user.
fn reason(e: &io::Error) -> String {
    match e.kind() {
        io::ErrorKind::AddrInUse => "the port is in use".into(),
        io::ErrorKind::AddrNotAvailable => "the address is not one of this computer".into(),
        io::ErrorKind::PermissionDenied => "permission denied; ports below 1024 need privileges".into(),
        io::ErrorKind::ConnectionRefused => "connection refused: nobody listens there".into(),
        io::ErrorKind::TimedOut => "no answer within 5 s".into(),
        io::ErrorKind::InvalidInput => "not an address; expected HOST:PORT".into(),
        _ => e.to_string(),
    }
}
