#include "tools/telesplat/bench_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include "common/core/clock.h"
#include "common/net/service.h"
#include "tools/telesplat/pipeline.h"

namespace telesplat::launcher {
namespace {

constexpr double kPatience_s = 20;                    // for processes to start
constexpr int kPackerNice = 5, kBackgroundNice = 10;  // as `telesplat run` has them

int count_alive(const nlohmann::json& status, const std::string& role) {
  int n = 0;
  // Values come with the first report, after the welcome.
  for (const auto& p : status.value("processes", nlohmann::json::array()))
    n += p.value("role", "") == role && p.value("alive", false) && p.contains("values");
  return n;
}

}  // namespace

Result<std::unique_ptr<BenchSession>> BenchSession::start(const std::vector<std::string>& scene_flags,
                                                          const std::string& directory, bool own_machines) {
  std::unique_ptr<BenchSession> s(new BenchSession);
  s->directory_ = directory;
  std::error_code error;
  std::filesystem::create_directories(directory + "/logs", error);
  if (error) return Error{fmt::format("{}: cannot be made: {}", directory, error.message())};
  if (const Status ok = s->launch(s->servers_, "master", "telesplat-master",
                                  {"--bind", "tcp://127.0.0.1:*", "--out", directory, "--progressive", "off"}, 0);
      !ok)
    return ok.error();
  const Status listens = s->wait_for("the master", [&] {
    for (const auto& line : s->servers_.front().read_lines())
      if (line.starts_with("listening on ")) s->endpoint_ = line.substr(13);
    return !s->endpoint_.empty();
  });
  if (!listens) return listens.error();
  std::vector<std::string> data{"julia"};
  data.insert(data.end(), scene_flags.begin(), scene_flags.end());
  if (const Status ok = s->launch(s->servers_, "data", "telesplat-data", data, kBackgroundNice); !ok) return ok.error();
  if (const Status ok = s->launch(s->servers_, "packer", "telesplat-packer", {}, own_machines ? 0 : kPackerNice); !ok)
    return ok.error();

  s->control_ = std::make_unique<ControlClient>(s->endpoint_);
  wire::Hello hello;
  hello.role = "viewer";
  hello.name = "bench";
  s->link_.emplace(s->context_, s->endpoint_, hello);
  const Status joined = s->wait_for("data server and packer", [&] {
    s->pump(10);
    return s->subscribed_ && s->link_->session()->facts.contains("kind");
  });
  if (!joined) return joined.error();
  return s;
}

BenchSession::~BenchSession() { finish(); }

Status BenchSession::launch(std::vector<ChildProcess>& into, const std::string& name, const std::string& program,
                            std::vector<std::string> arguments, int nice) {
  arguments.insert(arguments.end(), {"--name", name, "--log-level", "warn"});
  if (!endpoint_.empty()) arguments.insert(arguments.end(), {"--master", endpoint_});
  auto child = ChildProcess::start(name, program_directory() + "/" + program, arguments,
                                   fmt::format("{}/logs/{}.log", directory_, name), nice);
  if (!child) return child.error();
  into.push_back(std::move(*child));
  return ok_status();
}

Status BenchSession::alive() {
  if (net::stop_requested()) return Error{"interrupted"};
  for (auto* group : {&servers_, &samplers_})
    for (auto& p : *group)
      if (p.ended() && p.exit_code() != 128 + SIGKILL)
        return Error{fmt::format("{} ended with code {}; see {}/logs", p.name(), p.exit_code(), directory_)};
  return ok_status();
}

Status BenchSession::wait_for(const char* what, auto condition) {
  for (const double until = monotonic_s() + kPatience_s; !condition();) {
    if (const Status s = alive(); !s) return s;
    if (monotonic_s() > until)
      return Error{fmt::format("{} did not start within {} s; see {}/logs", what, kPatience_s, directory_)};
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return ok_status();
}

Status BenchSession::add_samplers(size_t count, const std::vector<std::string>& flags) {
  while (samplers_.size() < count) {
    const Status s =
        launch(samplers_, fmt::format("sampler-{}", samplers_.size() + 1), "telesplat-sampler", flags, kBackgroundNice);
    if (!s) return s;
  }
  double asked_s = -1e9;
  return wait_for("the samplers", [&] {
    pump(0);
    if (monotonic_s() - asked_s < 0.2) return false;
    asked_s = monotonic_s();
    const auto status = ask_status();
    return status && count_alive(*status, "sampler") >= int(count);
  });
}

std::optional<nlohmann::json> BenchSession::ask_status() {
  const auto answer = control_->ask("status", 2);
  if (!answer) return std::nullopt;
  auto json = nlohmann::json::parse(*answer, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  return json;
}

Status BenchSession::request(const geometry::Camera& camera) {
  request_ = request_.next();
  progress_ = {};
  requested_s_ = heard_s_ = monotonic_s();
  if (!link_->socket().send(wire::ViewRequest{link_->instance(), request_, camera, requested_s_}))
    return Error{"the master takes no requests"};
  return ok_status();
}

Result<BenchSession::Progress> BenchSession::receive(double patience_s) {
  const int rows = progress_.rows;
  pump(50);
  const double now = monotonic_s();
  if (progress_.rows != rows) heard_s_ = now;
  if (!progress_.complete) progress_.elapsed_s = now - requested_s_;
  if (const Status s = alive(); !s) return s.error();
  if (now - heard_s_ > patience_s)
    return Error{fmt::format("nothing of the frame arrived for {:.0f} s; see {}/logs", patience_s, directory_)};
  return progress_;
}

// Keeps the connections going and takes what came.
void BenchSession::pump(int timeout_ms) {
  link_->tick(monotonic_s(), [] { return net::MasterLink::Values{}; });
  std::vector<net::Socket*> sockets{&link_->socket()};
  if (patches_) sockets.push_back(&*patches_);
  net::wait_readable(sockets, timeout_ms);
  while (const auto message = link_->socket().receive()) link_->handle(*message, monotonic_s());
  if (!patches_ && link_->session()) {
    const auto& endpoints = link_->session()->endpoints;
    if (const auto it = endpoints.find("patches"); it != endpoints.end()) {
      patches_.emplace(context_, net::Kind::kSub, "bench:patches",
                       net::SocketOptions{.max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes});
      if (const Status s = patches_->connect(it->second); !s) log::error("{}", s.error().text);
    }
  }
  if (!patches_) return;
  while (const auto message = patches_->receive()) {
    subscribed_ = true;  // state marks come twice a second
    if (message->type != wire::Patch::kName) continue;
    const auto patch = patches_->decode<wire::Patch>(*message);
    if (!patch || patch->viewer != link_->instance() || patch->request != request_) continue;
    progress_.rows += patch->rect.height;
    if (!patch->frame_complete) continue;
    progress_.complete = true;
    progress_.elapsed_s = monotonic_s() - requested_s_;
  }
}

void BenchSession::finish() {
  if (servers_.empty()) return;
  if (!endpoint_.empty() && !servers_.front().ended()) {
    if (link_) link_->leave([] { return net::MasterLink::Values{}; });
    ControlClient control(endpoint_);
    if (!control.ask("stop", 2)) servers_.front().signal(SIGTERM);
    servers_.front().finish(4);
  }
  for (auto* group : {&samplers_, &servers_}) {
    for (auto& p : *group) p.signal(SIGTERM);
    for (auto& p : *group) p.finish(2);
    group->clear();
  }
}

}  // namespace telesplat::launcher
