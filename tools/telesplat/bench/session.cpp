#include "tools/telesplat/bench/session.h"

#include <fmt/format.h>

#include "common/core/clock.h"

namespace telesplat::launcher {
namespace {

constexpr double kPatience_s = 20;  // for a Julia set's data server

}  // namespace

Result<std::unique_ptr<BenchSession>> BenchSession::start(const std::vector<std::string>& scene_flags,
                                                          const std::string& directory, bool own_machines) {
  std::unique_ptr<BenchSession> s(new BenchSession);
  std::vector<std::string> data{"julia"};
  data.insert(data.end(), scene_flags.begin(), scene_flags.end());
  // Every picture is sampled whole, and nothing of it left out (T7.3): the same view comes again and again.
  const std::vector<std::string> session{"--progressive", "off", "--steering", "off", "--packing.redundancy", "keep"};
  auto processes = BenchProcesses::start(data, session, directory, own_machines);
  if (!processes) return processes.error();
  s->processes_ = std::move(*processes);
  wire::Hello hello;
  hello.role = "viewer";
  hello.name = "bench";
  s->link_.emplace(s->context_, s->processes_->endpoint(), hello);
  if (const Status ok = s->processes_->wait_for_data(kPatience_s, [&] { s->pump(10); }); !ok) return ok.error();
  for (const double until = monotonic_s() + kPatience_s;
       !s->subscribed_ || !s->link_->session()->facts.contains("kind");) {
    s->pump(10);
    if (const Status ok = s->processes_->alive(); !ok) return ok.error();
    if (monotonic_s() > until) return Error{"the packer publishes nothing; see " + directory + "/logs"};
  }
  return s;
}

BenchSession::~BenchSession() { finish(); }

Status BenchSession::add_samplers(size_t count, const std::vector<std::string>& flags) {
  return processes_->add_samplers(count, flags, [&] { pump(0); });
}

Status BenchSession::request(const geometry::Camera& camera) {
  request_ = request_.next();
  progress_ = {};
  requested_s_ = heard_s_ = monotonic_s();
  if (!link_->socket().send(wire::ViewRequest{link_->instance(), request_, camera, {.requested_s = requested_s_}}))
    return Error{"the master takes no requests"};
  return ok_status();
}

Result<BenchSession::Progress> BenchSession::receive(double patience_s) {
  const int rows = progress_.rows;
  pump(50);
  const double now = monotonic_s();
  if (progress_.rows != rows) heard_s_ = now;
  if (!progress_.complete) progress_.elapsed_s = now - requested_s_;
  if (const Status s = processes_->alive(); !s) return s.error();
  if (now - heard_s_ > patience_s)
    return Error{fmt::format("nothing of the frame arrived for {:.0f} s; see {}/logs", patience_s, directory())};
  return progress_;
}

// Keeps the connections going and takes what came.
void BenchSession::pump(int timeout_ms) {
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
  if (!processes_) return;
  if (link_) link_->leave([] { return net::MasterLink::Values{}; });
  link_.reset();
  processes_->finish();
}

}  // namespace telesplat::launcher
