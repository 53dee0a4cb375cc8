// Serves a text over HTTP at /metrics, for programs that watch. It has a thread of its own; nothing that comes over the
// network reaches the master's loop. Only http_endpoint.cpp includes the library behind it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/core/result.h"

namespace telesplat::master {

class HttpEndpoint {
 public:
  static constexpr size_t kMostConnections = 32;     ///< at once; more are closed
  static constexpr size_t kMostRequestBytes = 8192;  ///< size of a request with its header
  static constexpr double kPatience_s = 5;           ///< for a whole request and its answer

  struct Options {
    std::string address = "127.0.0.1";  ///< IP address, or localhost
    int port = 0;
    bool insecure = false;  ///< the address need not be loopback
  };
  /// Binds and begins to serve; on loopback it serves only requests that name loopback as their host. Error: names the
  /// flag, the address and the cause.
  static Result<std::unique_ptr<HttpEndpoint>> open(const Options& options);
  ~HttpEndpoint();
  HttpEndpoint(const HttpEndpoint&) = delete;
  HttpEndpoint& operator=(const HttpEndpoint&) = delete;

  /// Sets the text that /metrics answers with from now on.
  void publish(std::string text);
  /// "http://127.0.0.1:9464/metrics"
  const std::string& url() const;

 private:
  struct Impl;
  explicit HttpEndpoint(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::master
