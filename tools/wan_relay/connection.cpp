#include "tools/wan_relay/connection.h"

#include <netinet/tcp.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <utility>

#include "common/core/clock.h"

namespace telesplat::wan_relay {
namespace {

using boost::system::error_code;

constexpr double kConnectPatience_s = 10;
constexpr size_t kLeastWindow = 256 << 10, kMostWindow = 16 << 20;
constexpr int kLeastBuffer = 32 << 10, kMostBuffer = 4 << 20, kSegment = 1448;
constexpr size_t kMostAtOnce = 64;  // pieces written together

// Returns the bytes that may be between a connection's ends: those that wait in the link and those under way.
size_t window_of(const links::Link& link) {
  if (link.rate_bit_s <= 0) return kMostWindow;
  const double under_way = link.rate_bit_s / 8 * (link.rtt_s / 2 + link.jitter_s);
  return std::clamp(size_t(links::queue_bytes(link) + 2 * under_way), kLeastWindow, 8 * kMostWindow);
}

}  // namespace

template <class Socket>
void size_as_on_network(Socket& socket, const links::Link& link) {
  if (link.rate_bit_s <= 0) return;
  error_code ignored;
  const int window = int(std::clamp(link.rate_bit_s / 8 * link.rtt_s, double(kLeastBuffer), double(kMostBuffer)));
  socket.set_option(boost::asio::socket_base::receive_buffer_size(window), ignored);
  socket.set_option(boost::asio::socket_base::send_buffer_size(kLeastBuffer), ignored);
  socket.set_option(boost::asio::detail::socket_option::integer<IPPROTO_TCP, TCP_MAXSEG>(kSegment), ignored);
}
template void size_as_on_network(Tcp::socket&, const links::Link&);
template void size_as_on_network(Tcp::acceptor&, const links::Link&);

Flow::Flow(Context& context, Tcp::socket& from, Tcp::socket& to, Way& way, size_t window, std::function<void()> ended)
    : from_(from), to_(to), way_(way), window_(window), ended_(std::move(ended)), due_(context) {}

void Flow::read() {
  if (reading_ || at_end_ || over_ || held_ >= window_) return;
  reading_ = true;
  from_.async_wait(Tcp::socket::wait_read, [self = shared_from_this()](const error_code& error) {
    if (self->over_) return;
    if (!error) return self->way_.join(self);
    self->reading_ = false;
    self->at_end_ = true;
    self->put({});
  });
}

void Flow::send_piece() {
  if (over_) return;
  std::string bytes(way_.shaper().piece(), '\0');
  error_code error;
  const size_t n = from_.read_some(boost::asio::buffer(bytes), error);
  reading_ = false;
  if (error == boost::asio::error::would_block) return read();
  at_end_ = bool(error);  // also after an error: earlier bytes are passed on
  bytes.resize(at_end_ ? 0 : n);
  put(std::move(bytes));
  read();
}

void Flow::put(std::string bytes) {
  held_ += bytes.size();
  const double due_s = way_.pass(monotonic_s(), bytes.size());
  line_.push_back({due_s, std::move(bytes)});
  write();
}

void Flow::write() {
  if (over_ || timing_ || !writing_.empty() || line_.empty()) return;
  const double now_s = monotonic_s();
  if (line_.front().due_s > now_s) {
    timing_ = true;
    due_.expires_at(time_point(line_.front().due_s));
    due_.async_wait([self = shared_from_this()](const error_code& error) {
      self->timing_ = false;
      if (!error) self->write();
    });
    return;
  }
  if (line_.front().bytes.empty()) {
    error_code ignored;  // fails if the receiver has gone: no matter
    to_.shutdown(Tcp::socket::shutdown_send, ignored);
    return finish();
  }
  std::vector<boost::asio::const_buffer> buffers;
  while (!line_.empty() && line_.front().due_s <= now_s && !line_.front().bytes.empty() &&
         writing_.size() < kMostAtOnce) {
    writing_.push_back(std::move(line_.front().bytes));
    line_.pop_front();
  }
  for (const auto& b : writing_) buffers.push_back(boost::asio::buffer(b));
  boost::asio::async_write(to_, buffers,
                           [self = shared_from_this()](const error_code& error, size_t n) { self->written(error, n); });
}

void Flow::written(const error_code& error, size_t bytes) {
  if (over_) return;
  if (error) return finish();  // later bytes have no receiver
  held_ -= bytes;
  writing_.clear();
  write();
  read();
}

void Flow::finish() {
  if (std::exchange(over_, true)) return;
  due_.cancel();
  if (ended_) std::exchange(ended_, nullptr)();
}

void Flow::stop() {
  ended_ = nullptr;
  finish();
}

Connection::Connection(Context& context, Tcp::socket near, Link link, std::function<void()> gone)
    : context_(context),
      near_(std::move(near)),
      far_(context),
      link_(link),
      gone_(std::move(gone)),
      patience_(context) {
  error_code ignored;
  near_.set_option(Tcp::no_delay(true), ignored);
  near_.non_blocking(true, ignored);
}

Connection::~Connection() {
  if (gone_) gone_();
}

void Connection::connect(const Tcp::endpoint& to, std::function<std::string(const error_code&)> told) {
  told_ = std::move(told);
  // The greeting of TCP takes a round trip.
  patience_.expires_at(time_point(monotonic_s() + link_.link.rtt_s));
  patience_.async_wait([self = shared_from_this(), to](const error_code& cancelled) {
    if (cancelled) return;
    error_code error;
    self->far_.open(to.protocol(), error);
    if (error) return self->connected(error);
    size_as_on_network(self->far_, self->link_.link);
    self->patience_.expires_after(
        std::chrono::duration_cast<Timer::duration>(std::chrono::duration<double>(kConnectPatience_s)));
    self->patience_.async_wait([self](const error_code& in_time) {
      if (!in_time) self->close();
    });
    self->far_.async_connect(to, [self](const error_code& failed) {
      self->patience_.cancel();
      self->connected(failed);
    });
  });
}

void Connection::connected(const error_code& error) {
  // A proxy is beside its client: its answer does not pass the link.
  const std::string answer = told_ ? std::exchange(told_, nullptr)(error) : std::string();
  error_code ignored;
  if (!answer.empty()) near_.write_some(boost::asio::buffer(answer), ignored);
  if (error) return close();
  begin();
}

void Connection::begin() {
  error_code ignored;
  far_.set_option(Tcp::no_delay(true), ignored);
  far_.non_blocking(true, ignored);
  const size_t window = window_of(link_.link);
  open_ = 2;
  const auto ended = [self = shared_from_this()] {
    if (--self->open_ == 0) self->close();
  };
  to_far_ = std::make_shared<Flow>(context_, near_, far_, link_.to_far, window, ended);
  to_near_ = std::make_shared<Flow>(context_, far_, near_, link_.to_near, window, ended);
  to_far_->start();
  to_near_->start();
}

void Connection::close() {
  patience_.cancel();
  error_code ignored;
  near_.close(ignored);
  far_.close(ignored);
  for (auto* flow : {&to_far_, &to_near_})
    if (*flow) (*flow)->stop();
}

}  // namespace telesplat::wan_relay
