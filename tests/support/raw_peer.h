// A peer that uses TCP, and as much of ZMTP 3.0 (rfc.zeromq.org/spec/23) as a test wants: it can be hostile.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

namespace telesplat::test {

class RawPeer {
 public:
  /// Connects to "tcp://127.0.0.1:PORT"; connected() returns the result.
  explicit RawPeer(const std::string& endpoint) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(std::atoi(endpoint.substr(endpoint.rfind(':') + 1).c_str())));
    connected_ = ::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~RawPeer() { ::close(fd_); }
  RawPeer(const RawPeer&) = delete;
  RawPeer& operator=(const RawPeer&) = delete;

  bool connected() const { return connected_; }
  /// False once the other side has closed the connection.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n <= 0) return false;
      bytes.remove_prefix(static_cast<size_t>(n));
    }
    return true;
  }
  /// Sends `bytes` until the other side has taken nothing for `quiet_ms`. Returns the number of complete sends.
  size_t send_until_full(std::string_view bytes, int quiet_ms) {
    size_t sent = 0;
    for (pollfd p{fd_, POLLOUT, 0}; ::poll(&p, 1, quiet_ms) > 0 && p.revents == POLLOUT;) {
      const ssize_t n = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (n == static_cast<ssize_t>(bytes.size())) ++sent;
      if (n >= 0 && n < static_cast<ssize_t>(bytes.size())) break;
    }
    return sent;
  }
  /// Ends both sides of the connection at once.
  void reset() {
    const linger at_once{1, 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    ::close(std::exchange(fd_, -1));
  }
  /// Reads until the other side closes the connection. False: it has not within `timeout_ms`.
  bool wait_hung_up(int timeout_ms) {
    char buffer[4096];
    for (pollfd p{fd_, POLLIN, 0}; ::poll(&p, 1, timeout_ms) > 0;)
      if (::recv(fd_, buffer, sizeof buffer, 0) <= 0) return true;
    return false;
  }

  /// Opens a ZMTP connection as a socket of this type ("DEALER", ...): nothing may be sent before the other side is
  /// ready. False: it closed the connection instead.
  bool shake_hands(std::string_view socket_type);
  /// Reads the other side's opening, after zmtp_opening() was sent.
  bool wait_ready() { return read(64) && read(2) && read(last_byte_); }  // greeting; READY's flags and size; READY

 private:
  bool read(size_t n) {
    char buffer[256];
    return n <= sizeof buffer && ::recv(fd_, buffer, n, MSG_WAITALL) == static_cast<ssize_t>(n) &&
           (last_byte_ = static_cast<unsigned char>(buffer[n - 1]), true);
  }

  int fd_;
  size_t last_byte_ = 0;
  bool connected_ = false;
};

inline std::string big_endian(uint64_t value, int bytes) {
  std::string out;
  for (int i = bytes - 1; i >= 0; --i) out += static_cast<char>(value >> (8 * i));
  return out;
}

/// The opening of a ZMTP 3.0 connection without security: greeting and READY.
inline std::string zmtp_opening(std::string_view socket_type) {
  std::string greeting = "\xff" + std::string(8, '\0') + "\x7f" + std::string("\x03\x00", 2) + "NULL";
  greeting.resize(64, '\0');
  const std::string ready =
      std::string("\x05READY\x0bSocket-Type") + big_endian(socket_type.size(), 4) + std::string(socket_type);
  return greeting + '\x04' + static_cast<char>(ready.size()) + ready;
}

inline bool RawPeer::shake_hands(std::string_view socket_type) {
  return send(zmtp_opening(socket_type)) && wait_ready();
}

/// A message frame.
inline std::string zmtp_frame(std::string_view body, bool more) {
  if (body.size() < 256)
    return std::string{static_cast<char>(more ? 1 : 0), static_cast<char>(body.size())} + std::string(body);
  return static_cast<char>(more ? 3 : 2) + big_endian(body.size(), 8) + std::string(body);
}

/// The header of a message frame that claims `size` bytes.
inline std::string zmtp_claim(uint64_t size) { return '\x02' + big_endian(size, 8); }

}  // namespace telesplat::test
