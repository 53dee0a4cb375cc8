#include "common/net/keys/doorkeeper.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "common/core/check.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/net/keys/key_files.h"

namespace telesplat::net {
namespace {

constexpr const char* kQuestions = "inproc://zeromq.zap.01";
constexpr size_t kMostFrames = 16, kMostAddress = 64;
// What ZAP's answers are made of.
constexpr std::string_view kVersion = "1.0", kCurve = "CURVE", kYes = "200", kNo = "400";

// What tells that a file was written anew.
using Stamp = std::tuple<dev_t, ino_t, off_t, int64_t, int64_t>;

Stamp stamp_of(const std::string& path) {
  struct stat about {};
  if (stat(path.c_str(), &about) != 0) return {};
  return {about.st_dev, about.st_ino, about.st_size, about.st_mtim.tv_sec, about.st_mtim.tv_nsec};
}

struct Question {
  std::string version, request, domain, address, mechanism, key;
};

}  // namespace

std::string text_of(const Visitor& v) { return fmt::format("{} {}", name_of(v.role), v.name); }

std::optional<Visitor> visitor_of(std::string_view text) {
  const size_t space = text.find(' ');
  const auto role = role_named(text.substr(0, space));
  if (!role || space == text.npos) return std::nullopt;
  return Visitor{*role, text.substr(space + 1)};
}

struct Doorkeeper::Impl {
  Impl(zmq::context_t& context, const Keys& keys)
      : folder(keys.folder),
        server(key_bytes(keys.server)),
        questions(context, zmq::socket_type::rep),
        told(context, zmq::socket_type::pair),
        tell(context, zmq::socket_type::pair) {
    static std::atomic<int> counter{0};
    const std::string end = fmt::format("inproc://doorkeeper-{}", ++counter);
    for (zmq::socket_t* s : {&questions, &told, &tell}) s->set(zmq::sockopt::linger, 0);
    told.bind(end);
    tell.connect(end);
    questions.bind(kQuestions);
  }

  // Nobody is let in whose file cannot be read: it may be there to keep somebody out.
  Status read_list() {
    stamp = stamp_of(folder + "/" + kAllowedFile);
    visitors.clear();
    const auto list = read_allow_list(folder);
    if (!list) return list.error();
    for (const Allowed& a : list->entries()) visitors[key_bytes(a.key)] = {a.role, a.name};
    return ok_status();
  }

  void follow_list() {
    if (stamp == stamp_of(folder + "/" + kAllowedFile)) return;
    if (const Status s = read_list(); !s)
      log::error("{}; nobody is let in until it can be read", s.error().text);
    else
      log::info("{}/{} has changed: {} keys are let in", folder, kAllowedFile, visitors.size());
  }

  std::optional<Question> hear() {
    std::vector<std::string> frames;
    zmq::message_t frame;
    do {
      if (!questions.recv(frame, zmq::recv_flags::none)) return std::nullopt;
      if (frames.size() < kMostFrames) frames.push_back(frame.to_string());
    } while (frame.more());
    frames.resize(std::max<size_t>(frames.size(), 7));
    // 0 version, 1 request, 2 domain, 3 address, 4 routing id, 5 mechanism, 6 key
    return Question{frames[0], frames[1], frames[2], frames[3], frames[5], frames[6]};
  }

  // Who asks; nothing: nobody who may come in, and `why`.
  std::optional<Visitor> look_up(const Question& q, std::string& why) {
    follow_list();
    if (q.version != kVersion || q.mechanism != kCurve) {
      why = "it shows no key";
      return std::nullopt;
    }
    const auto found = visitors.find(q.key);
    if (found == visitors.end() && q.key != server) {
      why = "its key is not on the allow-list";
      return std::nullopt;
    }
    const Visitor out = found == visitors.end() ? Visitor{Role::kServer, name_of(Role::kServer)}
                                                : Visitor{found->second.first, found->second.second};
    if (may_connect(out.role, q.domain)) return out;
    why = fmt::format("the key {} is {}'s", out.name, described(out.role));
    return std::nullopt;
  }

  void answer() {
    const auto q = hear();
    if (!q) return;
    std::string why;
    const auto visitor = look_up(*q, why);
    const std::string who = visitor ? text_of(*visitor) : std::string();
    const std::string_view frames[] = {kVersion, q->request, visitor ? kYes : kNo, visitor ? "" : "refused", who, ""};
    for (size_t i = 0; i < std::size(frames); ++i)
      questions.send(zmq::buffer(frames[i]),
                     i + 1 < std::size(frames) ? zmq::send_flags::sndmore : zmq::send_flags::none);
    if (!visitor && limiter.allow(monotonic_s())) {
      const std::string more =
          limiter.suppressed() ? fmt::format(" ({} more since the last such line)", limiter.suppressed()) : "";
      log::warn("{}: {} is not let in: {}{}", q->domain, q->address.substr(0, kMostAddress), why, more);
    }
  }

  void loop() {
    for (;;) {
      try {
        zmq::pollitem_t items[] = {{questions.handle(), 0, ZMQ_POLLIN, 0}, {told.handle(), 0, ZMQ_POLLIN, 0}};
        zmq::poll(items, std::size(items), std::chrono::milliseconds(-1));
        if (items[1].revents) return;
        if (items[0].revents) answer();
      } catch (const zmq::error_t& e) {
        if (e.num() != EINTR) log::error("keys: {}", e.what());
        if (e.num() == ETERM) return;
      }
    }
  }

  const std::string folder, server;
  zmq::socket_t questions, told, tell;
  Stamp stamp;
  std::unordered_map<std::string, std::pair<Role, std::string>> visitors;  // by the bytes of their keys
  log::RateLimiter limiter;
  std::thread thread;
};

Doorkeeper::Doorkeeper(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {
  impl_->thread = std::thread([this] { impl_->loop(); });
}

Result<std::unique_ptr<Doorkeeper>> Doorkeeper::open(zmq::context_t& context, const Keys& keys) {
  auto impl = std::make_unique<Impl>(context, keys);
  if (const Status s = impl->read_list(); !s) return s.error();
  return std::unique_ptr<Doorkeeper>(new Doorkeeper(std::move(impl)));
}

Doorkeeper::~Doorkeeper() {
  impl_->tell.send(zmq::message_t(), zmq::send_flags::dontwait);
  impl_->thread.join();
}

void guard(zmq::socket_t& socket, const Keys& keys, std::string_view serves) {
  CHECK(!keys.server_secret.empty() && !serves.empty());
  socket.set(zmq::sockopt::zap_domain, std::string(serves));
  socket.set(zmq::sockopt::curve_server, true);
  socket.set(zmq::sockopt::curve_secretkey, keys.server_secret);
}

void identify(zmq::socket_t& socket, const Keys& keys) {
  CHECK(keys.own.has_value());
  socket.set(zmq::sockopt::curve_serverkey, keys.server);
  socket.set(zmq::sockopt::curve_publickey, keys.own->pair.open);
  socket.set(zmq::sockopt::curve_secretkey, keys.own->pair.secret);
}

}  // namespace telesplat::net
