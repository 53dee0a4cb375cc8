#include "common/net/keys/doorkeeper.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
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
constexpr auto kLook = std::chrono::milliseconds(1000);  // period of looks at the list, while no one comes
constexpr size_t kMostFrames = 16, kMostAddress = 64;
// Parts of ZAP's answers.
constexpr std::string_view kVersion = "1.0", kCurve = "CURVE", kYes = "200", kNo = "400";

// Changes when a file is written anew.
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

std::string text_of(const Visitor& v) { return fmt::format("{} {} {}", name_of(v.role), v.name, v.key); }

std::optional<Visitor> visitor_of(std::string_view text) {
  const size_t name = text.find(' '), key = text.rfind(' ');
  const auto role = role_named(text.substr(0, name));
  if (!role || name == text.npos || key == name) return std::nullopt;
  return Visitor{*role, text.substr(name + 1, key - name - 1), text.substr(key + 1)};
}

struct Doorkeeper::Impl {
  Impl(zmq::context_t& context, const Keys& keys)
      : folder(keys.folder),
        server_key(keys.server),
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

  // Lets no one in if the file cannot be read: it may be there to keep a person out.
  Status read_list() {
    stamp = stamp_of(folder + "/" + kAllowedFile);
    visitors.clear();
    const auto list = read_allow_list(folder);
    if (!list) return list.error();
    auto now = std::make_shared<std::set<std::string>>();
    now->insert(text_of(server_visitor()));
    for (const Allowed& a : list->entries()) {
      visitors[key_bytes(a.key)] = a;
      now->insert(text_of({a.role, a.name, a.key}));
    }
    const std::lock_guard lock(mutex);
    may_stay = std::move(now);
    return ok_status();
  }

  Visitor server_visitor() const { return {Role::kServer, name_of(Role::kServer), server_key}; }

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

  // Returns the owner of the key that a question shows; nothing, and `why`: the key is not let in.
  std::optional<Visitor> look_up(const Question& q, std::string& why) {
    if (q.version != kVersion || q.mechanism != kCurve) {
      why = "it shows no key";
      return std::nullopt;
    }
    const auto found = visitors.find(q.key);
    if (found == visitors.end() && q.key != server) {
      why = "its key is not on the allow-list";
      return std::nullopt;
    }
    const Visitor out =
        found == visitors.end() ? server_visitor() : Visitor{found->second.role, found->second.name, found->second.key};
    if (may_connect(out.role, q.domain)) return out;
    why = fmt::format("the key {} is {}'s", out.name, described(out.role));
    return std::nullopt;
  }

  void answer() {
    const auto q = hear();
    if (!q) return;
    std::string why;
    std::optional<Visitor> visitor;
    // ZeroMQ lets in only peers that are answered, and needs an answer to each question: so exceptions end here.
    try {
      visitor = look_up(*q, why);
    } catch (const std::exception& e) {
      why = e.what();
    }
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
        zmq::poll(items, std::size(items), kLook);
        if (items[1].revents) return;
        follow_list();
        if (items[0].revents) answer();
      } catch (const zmq::error_t& e) {
        if (e.num() != EINTR) log::error("keys: {}", e.what());
        if (e.num() == ETERM) return;
      } catch (const std::exception& e) {
        if (limiter.allow(monotonic_s())) log::error("keys: {}", e.what());
      }
    }
  }

  const std::string folder, server_key, server;  // server: the key's bytes
  zmq::socket_t questions, told, tell;
  Stamp stamp;
  std::unordered_map<std::string, Allowed> visitors;  // by the bytes of their keys
  mutable std::mutex mutex;                           // guards may_stay, which other threads read
  std::shared_ptr<const std::set<std::string>> may_stay;
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

std::shared_ptr<const std::set<std::string>> Doorkeeper::may_stay() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->may_stay;
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
