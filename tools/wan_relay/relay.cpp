#include "tools/wan_relay/relay.h"

#include <fmt/format.h>
#include <sys/signalfd.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <csignal>
#include <utility>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "tools/wan_relay/connection.h"
#include "tools/wan_relay/socks.h"

namespace telesplat::wan_relay {
namespace {

using boost::system::error_code;

constexpr double kDialoguePatience_s = 10, kAcceptPause_s = 0.1;

Timer::duration seconds(double s) {
  return std::chrono::duration_cast<Timer::duration>(std::chrono::duration<double>(s));
}

/// Blocks the signals that this process reads, and returns a descriptor for reading them. Handlers would interrupt the
/// relay at each signal, and Boost.Asio 1.74 reads signals until no more come: a process that gets SIGTERM without a
/// pause would not end.
int read_signals() {
  sigset_t known;
  sigemptyset(&known);
  for (const int number : {SIGINT, SIGTERM, SIGUSR1}) sigaddset(&known, number);
  pthread_sigmask(SIG_BLOCK, &known, nullptr);
  return ::signalfd(-1, &known, SFD_CLOEXEC | SFD_NONBLOCK);
}

std::string shown(const Tcp::endpoint& at) {
  const auto host = at.address().to_string();
  return fmt::format("{}:{}", at.address().is_v6() ? "[" + host + "]" : host, at.port());
}

std::string traffic(const Way& way, double lasted_s) {
  return fmt::format("{:.3f} MB, {:.2f} mbit/s, queue at most {:.0f} KB", double(way.bytes()) / 1e6,
                     double(way.bytes()) * 8e-6 / std::max(lasted_s, 1e-9), double(way.most_queued()) / 1e3);
}

}  // namespace

struct Relay::Impl {
  Impl(const Options& o, double now_s)
      : options(o), from_s(now_s), to_far(context, o.link, now_s, 1), to_near(context, o.link, now_s, 2) {}

  struct OpenDoor {
    Tcp::acceptor acceptor;
    Timer pause;
    Door door;
  };

  Status open(const Door& door) {
    error_code error;
    const Tcp::endpoint at(boost::asio::ip::make_address(door.host, error), uint16_t(std::stoi(door.port)));
    doors.push_back({Tcp::acceptor(context), Timer(context), door});
    auto& acceptor = doors.back().acceptor;
    acceptor.open(at.protocol(), error);
    acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
    size_as_on_network(acceptor, options.link);  // accepted sockets inherit the sizes
    if (!acceptor.bind(at, error)) acceptor.listen(boost::asio::socket_base::max_listen_connections, error);
    if (error) return Error{fmt::format("cannot listen at {}: {}", shown(at), error.message())};
    return ok_status();
  }

  void accept(OpenDoor& d) {
    d.acceptor.async_accept([this, &d](const error_code& error, Tcp::socket near) {
      if (error == boost::asio::error::operation_aborted) return;
      if (!error) {
        take(d.door, std::move(near));
        return accept(d);
      }
      // Too many open files, for example: that passes.
      complain("a connection cannot be taken: " + error.message());
      d.pause.expires_after(seconds(kAcceptPause_s));
      d.pause.async_wait([this, &d](const error_code& cancelled) {
        if (!cancelled) accept(d);
      });
    });
  }

  void take(const Door& door, Tcp::socket near) {
    ++taken;
    ++now_open;
    auto connection = std::make_shared<Connection>(
        context, std::move(near), Connection::Link{to_far, to_near, options.link}, [this] { --now_open; });
    if (door.to_host.empty()) return std::make_shared<Dialogue>(*this, std::move(connection))->read();
    resolve(connection, door.to_host, door.to_port, [this, where = door.to_host + ":" + door.to_port](auto& error) {
      note(where, error);
      return std::string();
    });
  }

  using Told = std::function<std::string(const error_code&)>;
  void resolve(std::shared_ptr<Connection> connection, const std::string& host, const std::string& port, Told told) {
    auto resolver = std::make_shared<Tcp::resolver>(context);
    resolver->async_resolve(
        host, port, [resolver, connection, told = std::move(told)](const error_code& error, auto found) {
          // Services listen at IPv4 addresses by default.
          const auto v4 = std::find_if(found.begin(), found.end(),
                                       [](const auto& entry) { return entry.endpoint().address().is_v4(); });
          if (!error) return connection->connect(v4 == found.end() ? *found.begin() : *v4, told);
          const std::string answer = told(error);
          error_code ignored;
          if (!answer.empty()) connection->near().write_some(boost::asio::buffer(answer), ignored);
          connection->close();
        });
  }

  void note(const std::string& where, const error_code& error) {
    if (!error) return;
    ++failed;
    complain(fmt::format("no connection to {}: {}", where, error.message()));
  }

  void complain(const std::string& what) {
    if (limiter.allow(monotonic_s())) log::warn("{}", what);
  }

  /// The dialogue with a SOCKS client, before its connection passes bytes on.
  struct Dialogue : std::enable_shared_from_this<Dialogue> {
    Dialogue(Impl& relay, std::shared_ptr<Connection> connection)
        : relay(relay), connection(std::move(connection)), patience(relay.context) {
      patience.expires_after(seconds(kDialoguePatience_s));
      patience.async_wait([c = std::weak_ptr(this->connection)](const error_code& in_time) {
        if (const auto late = c.lock(); late && !in_time) late->close();
      });
    }
    void read() {
      connection->near().async_read_some(boost::asio::buffer(buffer),
                                         [self = shared_from_this()](const error_code& error, size_t n) {
                                           if (error) return self->connection->close();
                                           self->on_bytes({self->buffer.data(), n});
                                         });
    }
    void on_bytes(std::string_view bytes) {
      const Status taken = dialogue.take(bytes);
      error_code ignored;
      if (const std::string answer = dialogue.take_answer(); !answer.empty())
        connection->near().write_some(boost::asio::buffer(answer), ignored);
      if (!taken) {
        ++relay.failed;
        relay.complain("a client of --socks " + taken.error().text);
        return connection->close();
      }
      if (dialogue.state() != SocksDialogue::State::kAsked) return read();
      patience.cancel();
      const std::string where = fmt::format("{}:{}", dialogue.host(), dialogue.port());
      relay.resolve(connection, dialogue.host(), std::to_string(dialogue.port()), [&r = relay, where](auto& error) {
        r.note(where, error);
        using Outcome = SocksDialogue::Outcome;
        return SocksDialogue::reply(!error                                            ? Outcome::kConnected
                                    : error == boost::asio::error::connection_refused ? Outcome::kRefused
                                                                                      : Outcome::kUnreachable);
      });
    }
    Impl& relay;
    std::shared_ptr<Connection> connection;
    Timer patience;
    SocksDialogue dialogue;
    std::array<char, 512> buffer;
  };

  const Options& options;
  const double from_s;
  Context context{1};
  boost::asio::posix::stream_descriptor signals{context, read_signals()};
  signalfd_siginfo signal{};  // the newest
  Way to_far, to_near;
  std::deque<OpenDoor> doors;
  uint64_t taken = 0, now_open = 0, failed = 0;
  log::RateLimiter limiter;
};

Relay::Relay(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Relay::~Relay() = default;

Result<std::unique_ptr<Relay>> Relay::open(const Options& options) {
  auto impl = std::make_unique<Impl>(options, monotonic_s());
  for (const Door& door : options.doors)
    if (const Status s = impl->open(door); !s) return s.error();
  return std::unique_ptr<Relay>(new Relay(std::move(impl)));
}

std::vector<std::string> Relay::addresses() const {
  std::vector<std::string> out;
  error_code ignored;
  for (const auto& d : impl_->doors) out.push_back(shown(d.acceptor.local_endpoint(ignored)));
  return out;
}

std::string Relay::statistics() const {
  const Impl& r = *impl_;
  const double lasted_s = monotonic_s() - r.from_s;
  return fmt::format("{} for {:.1f} s: {} connections, {} open, {} failed; to the far side {}; to the near side {}",
                     links::text_of(r.options.link), lasted_s, r.taken, r.now_open, r.failed,
                     traffic(r.to_far, lasted_s), traffic(r.to_near, lasted_s));
}

void Relay::run(const std::function<void(const std::string&)>& tell) {
  Impl& r = *impl_;
  const std::function<void(const error_code&, size_t)> answer = [&](const error_code& error, size_t) {
    if (error || r.signal.ssi_signo != SIGUSR1) return r.context.stop();
    tell(statistics());
    r.signals.async_read_some(boost::asio::buffer(&r.signal, sizeof r.signal), answer);
  };
  r.signals.async_read_some(boost::asio::buffer(&r.signal, sizeof r.signal), answer);
  for (auto& d : r.doors) r.accept(d);
  r.context.run();
}

}  // namespace telesplat::wan_relay
