#include "services/master/live/http_endpoint.h"

#include <fmt/format.h>
#include <signal.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/net/service.h"

namespace telesplat::master {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

constexpr auto kAfterFailure = std::chrono::milliseconds(200);  // wait after accept() failed: no descriptors are left
constexpr int kBacklog = 16;

// True for names by which programs of this machine call it. A page in a browser here, whose own name was made to point
// to this address, sends that name instead.
bool is_loopback_name(std::string_view host) {
  if (const size_t colon = host.rfind(':'); colon != host.npos && host.find(']', colon) == host.npos)
    host = host.substr(0, colon);
  if (beast::iequals({host.data(), host.size()}, "localhost")) return true;
  beast::error_code error;
  if (host.starts_with('[') && host.ends_with(']'))
    return asio::ip::make_address_v6(std::string(host.substr(1, host.size() - 2)), error).is_loopback() && !error;
  return asio::ip::make_address_v4(std::string(host), error).is_loopback() && !error;
}

struct Shared {
  bool local = true;  // bound to loopback
  std::mutex mutex;
  std::shared_ptr<const std::string> text = std::make_shared<const std::string>();
  size_t connections = 0;  // used by the thread alone

  std::shared_ptr<const std::string> now() {
    const std::lock_guard lock(mutex);
    return text;
  }
};

/// A connection: one request and one answer, within kPatience_s.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, Shared& shared) : stream_(std::move(socket)), shared_(shared) {
    ++shared_.connections;
    parser_.header_limit(HttpEndpoint::kMostRequestBytes);
    parser_.body_limit(0);
  }
  ~Connection() { --shared_.connections; }

  void begin() {
    stream_.expires_after(
        std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(HttpEndpoint::kPatience_s)));
    http::async_read_header(stream_, buffer_, parser_,
                            [self = shared_from_this()](beast::error_code error, size_t) { self->answer(error); });
  }

 private:
  void answer(beast::error_code error) {
    if (error == http::error::end_of_stream || error == beast::error::timeout) return;
    if (error && error.category() != http::make_error_code(http::error::bad_method).category()) return;
    if (error)
      fill(http::status::bad_request, "no request that is understood here\n");
    else
      look_up(parser_.get());
    response_.version(11);
    response_.set(http::field::content_type, "text/plain; version=0.0.4; charset=utf-8");
    response_.keep_alive(false);
    response_.prepare_payload();
    if (!error && parser_.get().method() == http::verb::head) response_.body().clear();
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code, size_t) {
      beast::error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  void look_up(const http::request<http::empty_body>& request) {
    const std::string target(request.target());
    const std::string path = target.substr(0, target.find('?'));
    if (shared_.local && !is_asked_locally(request))
      fill(http::status::forbidden, "the name of the host is not this machine's own, such as localhost\n");
    else if (request.method() != http::verb::get && request.method() != http::verb::head)
      fill(http::status::method_not_allowed, "GET is understood here\n");
    else if (path == "/metrics")
      fill(http::status::ok, *shared_.now());
    else if (path == "/")
      fill(http::status::ok, "A session of Telesplat. /metrics has its figures, in Prometheus' text format.\n");
    else
      fill(http::status::not_found, "nothing is here; /metrics has the figures\n");
  }

  static bool is_asked_locally(const http::request<http::empty_body>& request) {
    const auto hosts = request.count(http::field::host);
    if (hosts == 0) return request.version() < 11;
    return hosts == 1 && is_loopback_name(std::string(request[http::field::host]));
  }

  void fill(http::status status, std::string text) {
    response_.result(status);
    response_.body() = std::move(text);
  }

  beast::tcp_stream stream_;
  Shared& shared_;
  beast::flat_buffer buffer_{HttpEndpoint::kMostRequestBytes};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

struct HttpEndpoint::Impl {
  Shared shared;  // outlives the connections, which io holds
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  asio::steady_timer again{io};
  std::string url;
  log::RateLimiter limiter;  // used by the thread alone
  std::thread thread;

  void accept() {
    acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (error) {
        if (!acceptor.is_open()) return;
        again.expires_after(kAfterFailure);
        return again.async_wait([this](beast::error_code stopped) {
          if (!stopped) accept();
        });
      }
      if (shared.connections < kMostConnections)
        guard([&] { std::make_shared<Connection>(std::move(socket), shared)->begin(); });
      accept();
    });
  }

  // Runs work() and logs its exceptions: a connection for which there is no memory is closed, the others go on.
  template <class Work>
  void guard(Work&& work) {
    try {
      work();
    } catch (const std::exception& e) {
      if (limiter.allow(monotonic_s())) log::error("an answer about the session's figures failed: {}", e.what());
    }
  }

  // Starts the thread with all signals blocked: they are for the master's loop.
  void start() {
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    thread = std::thread([this] {
      net::lower_thread_priority(5);
      guard([this] { accept(); });
      while (!io.stopped()) guard([this] { io.run(); });
    });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }
};

HttpEndpoint::HttpEndpoint(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

HttpEndpoint::~HttpEndpoint() {
  impl_->io.stop();
  if (impl_->thread.joinable()) impl_->thread.join();
}

Result<std::unique_ptr<HttpEndpoint>> HttpEndpoint::open(const Options& o) {
  beast::error_code error;
  const auto address = asio::ip::make_address(o.address == "localhost" ? "127.0.0.1" : o.address, error);
  if (error) return Error{fmt::format("--metrics-address {}: is no IP address", o.address)};
  if (!address.is_loopback() && !o.insecure)
    return Error{
        fmt::format("--metrics-address {}: is not a loopback address; without encryption and authentication "
                    "that needs --insecure",
                    o.address)};
  auto impl = std::make_unique<Impl>();
  impl->shared.local = address.is_loopback();
  const tcp::endpoint endpoint(address, uint16_t(o.port));
  impl->acceptor.open(endpoint.protocol(), error);
  if (!error) impl->acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) impl->acceptor.bind(endpoint, error);
  if (!error) impl->acceptor.listen(kBacklog, error);
  if (error) return Error{fmt::format("--metrics-port {}: {} cannot be bound: {}", o.port, o.address, error.message())};
  const std::string host = address.is_v6() ? "[" + address.to_string() + "]" : address.to_string();
  impl->url = fmt::format("http://{}:{}/metrics", host, o.port);
  impl->start();
  return std::unique_ptr<HttpEndpoint>(new HttpEndpoint(std::move(impl)));
}

void HttpEndpoint::publish(std::string text) {
  auto next = std::make_shared<const std::string>(std::move(text));
  const std::lock_guard lock(impl_->shared.mutex);
  impl_->shared.text.swap(next);
}

const std::string& HttpEndpoint::url() const { return impl_->url; }

}  // namespace telesplat::master
