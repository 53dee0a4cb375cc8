#include "common/net/connections/connections.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/tcp.h>  // has newer fields than the C library
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/core/clock.h"

namespace telesplat::net {

namespace {

constexpr size_t kMostEnded = 4096;  // ended connections; above, all are judged at once, even unread ones
constexpr double kLatePeriod_s = 0.1;
constexpr uint64_t kNobodyKnows = ~uint64_t(0);  // not a TCP connection

struct Passed {
  uint64_t taken = kNobodyKnows, came = kNobodyKnows;  // bytes that the other machine, and this one, received
};

// If fd is another file's by now, the kernel reports none or too few bytes. shut_down() checks again before it acts.
Passed passed(int fd) {
  tcp_info about{};
  socklen_t size = sizeof about;
  const bool told = getsockopt(fd, IPPROTO_TCP, TCP_INFO, &about, &size) == 0 &&
                    size >= offsetof(tcp_info, tcpi_bytes_received) + sizeof about.tcpi_bytes_received;
  return told ? Passed{about.tcpi_bytes_acked, about.tcpi_bytes_received} : Passed{};
}

constexpr int kFailed =
    ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

}  // namespace

// Only a monitor sees peers that fail their handshake (random bytes, another protocol) or are disconnected for a frame
// that claims too much. ZeroMQ reads unknown bytes as its oldest protocol, so that it may not even report a failed
// handshake.
Connections::Connections(zmq::context_t& context, zmq::socket_t& socket, Options options)
    : options_(std::move(options)),
      monitor_(context, socket, ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_DISCONNECTED | (options_.guarded ? kFailed : 0)),
      blank_(eventfd(0, EFD_CLOEXEC)),
      spare_(fcntl(blank_, F_DUPFD_CLOEXEC, 0)) {}

Connections::~Connections() {
  ::close(spare_);
  ::close(blank_);
}

int Connections::descriptor() { return monitor_.descriptor(); }

void Connections::look() {
  const std::lock_guard lock(mutex_);
  drain();
  keep_to_limit();
}

void Connections::keep_to_limit() {
  while (open_.size() - refused_open_ > options_.most) hang_up_on_one();
}

void Connections::drain() {
  const double now_s = monotonic_s();
  while (const auto event = monitor_.next()) take(*event, now_s);
}

// One thread of ZeroMQ reports a connection's end, without a pause: first that its handshake broke off, then the end.
void Connections::take(const Monitor::Event& event, double now_s) {
  if (event.what & kFailed) {
    ++failed_unseen_;
    ++counts_.keys_refused;
  } else if (event.what == ZMQ_EVENT_ACCEPTED) {
    open_[event.value] = {.fd = event.value, .number = ++accepted_, .accepted_s = now_s};
    while (!young_.empty() && !may_shake_hands(young_.front(), now_s)) young_.pop_front();
    young_.emplace_back(event.value, accepted_);
  } else {
    ended(event.value);
  }
  broke_off_ = event.what == ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL;
}

void Connections::ended(int fd) {
  const auto it = open_.find(fd);
  if (it == open_.end()) return;
  if (!it->second.refused) {
    ended_.push_back(it->second);
  } else {
    --refused_open_;
    if (broke_off_) --failed_unseen_, --counts_.keys_refused;  // this process broke it off
  }
  open_.erase(it);
  if (ended_.size() + to_judge_.size() < kMostEnded) return;
  counts_.silent += silent_among(std::exchange(to_judge_, {})) + silent_among(std::exchange(ended_, {}));
}

bool Connections::is_open(const Name& name) const {
  const auto found = open_.find(name.first);
  return found != open_.end() && found->second.number == name.second && !found->second.refused;
}

bool Connections::may_shake_hands(const Name& name, double now_s) const {
  if (!is_open(name)) return false;
  const Connection& c = open_.at(name.first);
  return !c.has_spoken && now_s - c.accepted_s <= kHandshake_s;
}

// Hangs up on the oldest connection that may still be shaking hands, so that silent peers cannot keep others out;
// without any such connection, on the newest.
void Connections::hang_up_on_one() {
  const double now_s = monotonic_s();
  while (!young_.empty()) {
    const Name first = young_.front();
    young_.pop_front();
    if (may_shake_hands(first, now_s)) return hang_up(first);
  }
  const Connection* last = nullptr;
  for (const auto& [fd, c] : open_)
    if (!c.refused && (!last || c.number > last->number)) last = &c;
  hang_up({last->fd, last->number});
}

void Connections::hang_up(const Name& name) {
  refuse(name, fmt::format("{} connections are open (--max-connections): one more is refused", options_.most),
         End::kReadsOn);
}

void Connections::refuse(const Name& name, const std::string& why, End end) {
  if (!shut_down(name, end)) return;
  ++counts_.refused;
  if (!limiter_.allow(monotonic_s())) return;
  const std::string more =
      limiter_.suppressed() ? fmt::format(" ({} more since the last such line)", limiter_.suppressed()) : "";
  log::warn("{}: {}{}", options_.name, why, more);
}

bool Connections::hang_up_on_unread() {
  const std::lock_guard lock(mutex_);
  drain();
  std::vector<std::pair<Name, uint64_t>> full;
  for (const auto& [fd, c] : open_) {
    const uint64_t came = c.refused ? kNobodyKnows : passed(fd).came;
    if (came != kNobodyKnows && came > c.read && came - c.read > options_.most_unread)
      full.emplace_back(Name{fd, c.number}, came - c.read);
  }
  for (const auto& [name, bytes] : full)
    refuse(name,
           fmt::format("a connection is hung up on, because {:.0f} MB of it wait to be read, {:.0f} may",
                       double(bytes) / 1e6, double(options_.most_unread) / 1e6),
           End::kAtOnce);
  return !open_.empty();
}

void Connections::hang_up_on(int fd) {
  const std::lock_guard lock(mutex_);
  drain();
  if (const auto found = open_.find(fd); found != open_.end())
    refuse({fd, found->second.number}, "a connection is hung up on for what it said", End::kAtOnce);
}

// The descriptor may be another file's by now. ZeroMQ reports an end before it closes the file: if no end was reported
// after the descriptor was duplicated, the duplicate is the connection's.
bool Connections::shut_down(const Name& name, End end) {
  const bool looks = looks_at(name.first);
  drain();
  const bool there = is_open(name);
  // shutdown() alone would not end a peer that sends fast: ZeroMQ first reads all bytes that came.
  const sockaddr nobody{.sa_family = AF_UNSPEC, .sa_data = {}};
  const bool ended = there && looks && end == End::kAtOnce && ::connect(spare_, &nobody, sizeof nobody) == 0;
  if (there && looks && !ended) shutdown(spare_, SHUT_RDWR);
  if (there) open_.at(name.first).refused = true, ++refused_open_;
  look_away();
  return there;
}

bool Connections::looks_at(int fd) { return dup3(fd, spare_, O_CLOEXEC) >= 0; }
void Connections::look_away() { dup3(blank_, spare_, O_CLOEXEC); }

void Connections::published(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  published_ += bytes;
}

size_t Connections::hang_up_on_late(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  const double now_s = monotonic_s();
  if (now_s - looked_for_late_s_ < kLatePeriod_s) return 0;
  looked_for_late_s_ = now_s;
  drain();
  std::vector<Name> late;
  for (const auto& [fd, c] : open_) {
    const uint64_t taken = c.has_spoken && !c.refused ? passed(fd).taken : kNobodyKnows;
    if (taken == kNobodyKnows || c.taken == kNobodyKnows) continue;
    if (published_ - c.published > taken - c.taken + bytes) late.emplace_back(fd, c.number);
  }
  const auto gone = std::count_if(late.begin(), late.end(), [&](const Name& name) { return shut_down(name); });
  if (gone > 0)
    log::warn("{}: {} subscribers are hung up on, because more than {:.0f} MB wait for each (--queue-limit-mb)",
              options_.name, gone, double(bytes) / 1e6);
  return size_t(gone);
}

void Connections::spoke(int fd, uint64_t bytes, std::string_view user) {
  const std::lock_guard lock(mutex_);
  drain();  // ZeroMQ reports the acceptance before it delivers the message
  const auto it = open_.find(fd);
  for (auto* gone : {&to_judge_, &ended_}) {
    const auto found =
        std::find_if(gone->begin(), gone->end(), [&](const Connection& c) { return c.fd == fd && !c.has_spoken; });
    if (found == gone->end()) continue;
    found->has_spoken = true;
    // Counts the message for the newer connection with this descriptor, if that one received as many bytes.
    if (it == open_.end() || passed(fd).came < it->second.read + bytes) return;
    break;
  }
  if (it != open_.end()) {
    Connection& c = it->second;
    c.read += bytes;
    c.user = user;
    if (!std::exchange(c.has_spoken, true)) {
      c.published = published_;
      if (options_.publishes) c.taken = passed(fd).taken;
    }
  }
  keep_to_limit();
}

std::vector<std::string> Connections::keep_only(const std::set<std::string>& users) {
  const std::lock_guard lock(mutex_);
  drain();
  std::vector<std::pair<Name, std::string>> others;
  for (const auto& [fd, c] : open_)
    if (!c.refused && !c.user.empty() && !users.contains(c.user)) others.push_back({{fd, c.number}, c.user});
  std::vector<std::string> out;
  for (auto& [name, user] : others)
    if (shut_down(name)) out.push_back(std::move(user));
  return out;
}

void Connections::begin_reading() {
  look();
  const std::lock_guard lock(mutex_);
  to_judge_.insert(to_judge_.end(), ended_.begin(), ended_.end());
  ended_.clear();
}

uint64_t Connections::judge() {
  const std::lock_guard lock(mutex_);
  const uint64_t out = silent_among(std::exchange(to_judge_, {}));
  counts_.silent += out;
  return out;
}

// All processes of ours speak as soon as they are connected, except samplers, which push only when they have a tile.
uint64_t Connections::silent_among(const std::vector<Connection>& gone) {
  uint64_t out = 0;
  for (const Connection& c : gone) {
    if (c.has_spoken || monotonic_s() - c.accepted_s > options_.quiet_s) continue;
    if (failed_unseen_ > 0)
      --failed_unseen_;  // counted in keys_refused
    else
      ++out;
  }
  return out;
}

Connections::Counts Connections::counts() {
  look();
  const std::lock_guard lock(mutex_);
  Counts out = counts_;
  out.open = open_.size();
  return out;
}

namespace {

constexpr int kUntold_ms = 500;
constexpr int kUnread_ms = 50;  // bytes of a fast network are read into memory meanwhile, from any sender

}  // namespace

// Blocks all signals in the new thread: they go to the threads that wait for them.
Lookout::Lookout() : woken_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { loop(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Lookout::~Lookout() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake();
  thread_.join();
  ::close(woken_);
}

void Lookout::add(Connections& connections) {
  {
    const std::lock_guard lock(mutex_);
    watched_[&connections] = connections.descriptor();
  }
  wake();
}

void Lookout::remove(Connections& connections) {
  {
    const std::lock_guard lock(mutex_);
    watched_.erase(&connections);
  }
  wake();
}

void Lookout::wake() const {
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(woken_, &one, sizeof one);
}

void Lookout::loop() {
  std::vector<pollfd> items;
  for (;;) {
    bool anybody = false;
    {
      const std::lock_guard lock(mutex_);
      if (stop_) return;
      for (const auto& [connections, descriptor] : watched_) {
        connections->look();
        anybody |= connections->hang_up_on_unread();
      }
      items.assign(1, {woken_, POLLIN, 0});
      for (const auto& [connections, descriptor] : watched_) items.push_back({descriptor, POLLIN, 0});
    }
    // An event that the owner's thread took first does not wake this poll: hence the timeouts.
    ::poll(items.data(), items.size(), anybody ? kUnread_ms : kUntold_ms);
    uint64_t count = 0;
    [[maybe_unused]] const ssize_t read = ::read(woken_, &count, sizeof count);
  }
}

}  // namespace telesplat::net
