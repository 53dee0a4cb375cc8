#include "tools/lab/scaling/session.h"

#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/net/service.h"

namespace telesplat::lab {
namespace {

constexpr double kPatience_s = 20;                    // time for processes to start
constexpr double kAskEvery_s = 0.2;                   // asks the master for its processes this often
constexpr int kPackerNice = 5, kBackgroundNice = 10;  // the same as in `telesplat run`

}  // namespace

Session::Session(const std::string& directory) : directory_(directory), group_(directory + "/logs", "warn") {}

Session::~Session() { finish(); }

Result<std::unique_ptr<Session>> Session::start(const std::vector<std::string>& scene_flags,
                                                const std::string& directory, bool own_machines) {
  std::unique_ptr<Session> s(new Session(directory));
  if (const Status ok = s->start_processes(scene_flags, own_machines); !ok) return ok.error();
  if (const Status ok = s->join(); !ok) return ok.error();
  return s;
}

Status Session::start_processes(const std::vector<std::string>& scene_flags, bool own_machines) {
  unsetenv(net::kKeysVariable);  // this process has no keys
  // The master samples every picture whole (T7.3): the same view comes again and again.
  const std::vector<std::string> master{"--bind",
                                        "tcp://127.0.0.1:*",
                                        "--started-by",
                                        "bench",
                                        "--out",
                                        directory_,
                                        "--progressive",
                                        "off",
                                        "--steering",
                                        "off",
                                        "--packing.redundancy",
                                        "keep"};
  if (const Status s = group_.start_master(master, kPatience_s); !s) return s;
  control_ = std::make_unique<launcher::ControlClient>(group_.endpoint());
  std::vector<std::string> scene{"julia"};
  scene.insert(scene.end(), scene_flags.begin(), scene_flags.end());
  if (const Status s = group_.start({.role = "data", .name = "data", .arguments = scene, .nice = kBackgroundNice}); !s)
    return s;
  return group_.start({.role = "packer", .name = "packer", .arguments = {}, .nice = own_machines ? 0 : kPackerNice});
}

Status Session::join() {
  wire::Hello hello;
  hello.role = "viewer";
  hello.name = "bench";
  link_.emplace(context_, group_.endpoint(), hello);
  if (const Status s = wait_for("the packer", "packer", 1); !s) return s;
  if (const Status s = wait_for("the data server", "data", 1); !s) return s;
  for (const double until = monotonic_s() + kPatience_s; !subscribed_ || !link_->session()->facts.contains("kind");) {
    pump(10);
    if (const Status s = alive(); !s) return s;
    if (monotonic_s() > until) return Error{"the packer publishes nothing; see " + directory_ + "/logs"};
  }
  return ok_status();
}

Status Session::alive() {
  if (net::stop_requested()) return Error{"interrupted"};
  for (launcher::Member& m : group_.members())
    if (m.process->ended())
      return Error{fmt::format("{} ended with code {}; see {}/logs", m.name, m.process->exit_code(), directory_)};
  return ok_status();
}

int Session::count_joined(const std::string& role) {
  const auto status = control_->status(2);
  if (!status) return 0;
  int n = 0;
  // A process that has joined reports values a little later.
  for (const auto& p : status->value("processes", nlohmann::json::array()))
    n += p.value("role", "") == role && p.value("alive", false) && p.contains("values");
  return n;
}

Status Session::wait_for(const char* what, const std::string& role, int count) {
  double asked_s = -1e9;
  for (const double until = monotonic_s() + kPatience_s;;) {
    if (const Status s = alive(); !s) return s;
    pump(5);
    if (monotonic_s() - asked_s >= kAskEvery_s) {
      asked_s = monotonic_s();
      if (count_joined(role) >= count) return ok_status();
    }
    if (monotonic_s() > until)
      return Error{fmt::format("{} did not start within {} s; see {}/logs", what, kPatience_s, directory_)};
  }
}

Status Session::add_samplers(size_t count, const std::vector<std::string>& flags) {
  while (samplers_ < count) {
    launcher::Member sampler{
        .role = "sampler", .name = fmt::format("sampler-{}", ++samplers_), .arguments = flags, .nice = kBackgroundNice};
    if (const Status s = group_.start(std::move(sampler)); !s) return s;
  }
  return wait_for("the samplers", "sampler", int(count));
}

Result<double> Session::frame(const geometry::Camera& camera, double patience_s,
                              const std::function<void(const Progress&)>& watch) {
  request_ = request_.next();
  progress_ = {};
  requested_s_ = monotonic_s();
  if (!link_->socket().send(wire::ViewRequest{link_->instance(), request_, camera, {.requested_s = requested_s_}}))
    return Error{"the master takes no requests"};
  for (double heard_s = requested_s_; !progress_.complete;) {
    const int rows = progress_.rows;
    pump(50);
    const double now_s = monotonic_s();
    if (progress_.rows != rows) heard_s = now_s;
    if (progress_.complete) break;
    progress_.elapsed_s = now_s - requested_s_;
    if (const Status s = alive(); !s) return s.error();
    if (now_s - heard_s > patience_s)
      return Error{fmt::format("nothing of the frame arrived for {:.0f} s; see {}/logs", patience_s, directory_)};
    watch(progress_);
  }
  return progress_.elapsed_s;
}

// Keeps the connections alive and takes the messages that have arrived.
void Session::pump(int timeout_ms) {
  link_->tick(monotonic_s(), [] { return net::MasterLink::Values{}; });
  std::vector<net::Socket*> sockets{&link_->socket()};
  if (patches_) sockets.push_back(&*patches_);
  net::wait_readable(sockets, timeout_ms);
  while (const auto message = link_->socket().receive()) link_->handle(*message);
  if (!patches_ && link_->session()) {
    const auto& endpoints = link_->session()->endpoints;
    if (const auto it = endpoints.find("patches"); it != endpoints.end()) {
      patches_.emplace(context_, net::Kind::kSub, "bench:patches",
                       net::SocketOptions{.max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes});
      if (const Status s = patches_->connect(it->second); !s) log::error("{}", s.error().text);
    }
  }
  while (patches_) {
    const auto message = patches_->receive();
    if (!message) return;
    take(*message);
  }
}

void Session::take(const net::Message& message) {
  subscribed_ = true;  // state marks come twice a second
  if (message.type != wire::Patch::kName) return;
  const auto patch = patches_->decode<wire::Patch>(message);
  if (!patch || patch->viewer != link_->instance() || patch->request != request_) return;
  progress_.rows += patch->rect.height;
  if (!patch->frame_complete) return;
  progress_.complete = true;
  progress_.elapsed_s = monotonic_s() - requested_s_;
}

void Session::finish() {
  if (group_.members().empty()) return;
  if (link_) link_->leave([] { return net::MasterLink::Values{}; });
  link_.reset();
  group_.finish();
  group_.members().clear();
}

}  // namespace telesplat::lab
