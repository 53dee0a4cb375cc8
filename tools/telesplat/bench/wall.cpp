#include "tools/telesplat/bench/wall.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "common/core/clock.h"
#include "common/volume/warp/warper.h"

namespace telesplat::launcher {
namespace {

constexpr double kIntroduceEvery_s = 1, kTick_s = 0.05;
constexpr double kPatience_s = 2;  // for an answer; then the request is given up

double thread_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

}  // namespace

Result<ConstructionCost> measure_view(const wire::SliceFrame& f, const volume::Grid& grid,
                                      const geometry::Camera& camera, int passes) {
  if (const Status s = volume::validate(f.shear, grid); !s) return s.error();
  const std::span bytes(reinterpret_cast<const uint8_t*>(f.data.data()), f.data.size());
  volume::Warper warper(1);
  std::vector<uint32_t> colour(size_t(camera.width) * size_t(camera.height));
  ConstructionCost out{1e9, 1e9, bytes.size()};
  for (int pass = 0; pass < passes; ++pass) {
    const double begin_s = thread_s();
    const auto slices = volume::parse_slices(bytes, f.shear.width, f.shear.height, int(f.shear.layers.size()));
    if (!slices) return slices.error();
    std::vector<volume::SliceImage> images;
    for (const auto& slice : *slices) {
      auto image = volume::decode_slice(slice, f.shear.width, f.shear.height);
      if (!image) return image.error();
      images.push_back(std::move(*image));
    }
    const auto frame = volume::make_volume_frame(grid, f.shear, images, f.frame, f.epoch, bytes.size());
    const double decoded_s = thread_s();
    warper.render(&frame, camera, 0, {camera.width, camera.height, colour.data(), nullptr});
    out.decode_s = std::min(out.decode_s, decoded_s - begin_s);
    out.warp_s = std::min(out.warp_s, thread_s() - decoded_s);
  }
  return out;
}

WaitingViewer::WaitingViewer(net::Context& context, const std::string& master, const std::string& name,
                             const geometry::Camera& camera, int buffers)
    : context_(context), camera_(camera), buffers_(buffers), link_(context, master, [&] {
        wire::Hello hello;
        hello.role = "viewer";
        hello.name = name;
        return hello;
      }()) {}

std::vector<net::Socket*> WaitingViewer::sockets() {
  std::vector<net::Socket*> out{&link_.socket()};
  if (state_) out.push_back(&*state_);
  return out;
}

void WaitingViewer::take(const net::Message& message, double now_s) {
  if (message.type != wire::SliceFrame::kName) return;
  const auto frame = state_->decode<wire::SliceFrame>(message);
  if (!frame) return;
  known_ = true;
  const auto asked = std::find(requested_.begin(), requested_.end(), frame->request);
  if (frame->viewer != link_.instance() || asked == requested_.end()) {
    state_->send(wire::SliceAck{link_.instance(), frame->frame, uint64_t(buffers_), true});
    return;
  }
  requested_.erase(requested_.begin(), asked + 1);  // answers come in order: those before were dropped
  asked_s_ = now_s;
  newest_ = frame;
  newest_owner_ = message.owner;
  complete_.push_back(frame->frame);
}

double WaitingViewer::turn(double now_s, double cost_s, bool asks) {
  link_.tick(now_s, [] { return net::MasterLink::Values{}; });
  while (const auto message = link_.socket().receive()) link_.handle(*message);
  if (!state_ && link_.session()) {
    const auto& endpoints = link_.session()->endpoints;
    if (const auto it = endpoints.find("state"); it != endpoints.end()) {
      state_.emplace(context_, net::Kind::kDealer, "bench:state",
                     net::SocketOptions{.max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes});
      if (const Status s = state_->connect(it->second); !s) log::error("{}", s.error().text);
    }
  }
  if (!state_) return now_s + kTick_s;
  if (!known_ && now_s - introduced_s_ > kIntroduceEvery_s) {
    introduced_s_ = now_s;
    state_->send(wire::SliceAck{link_.instance(), FrameId{}, uint64_t(buffers_), true});
  }
  while (const auto message = state_->receive()) {
    const bool idle = complete_.empty();
    take(*message, now_s);
    if (idle && !complete_.empty()) ready_s_ = now_s + cost_s;
  }
  // The next construction begins when the one before ended, not when this process woke up.
  while (!complete_.empty() && ready_s_ <= now_s) {
    state_->send(wire::SliceAck{link_.instance(), complete_.front(), uint64_t(buffers_), true});
    complete_.pop_front();
    shown_s_.push_back(ready_s_);
    ready_s_ += cost_s;
  }
  if (!requested_.empty() && now_s - asked_s_ > kPatience_s) requested_.clear();
  while (asks && link_.session()->facts.contains("kind") && requested_.size() + complete_.size() < size_t(buffers_)) {
    link_.socket().send(wire::ViewRequest{
        link_.instance(), next_, camera_, {.requested_s = link_.to_master_s(now_s)}, uint64_t(buffers_)});
    if (requested_.empty()) asked_s_ = now_s;
    requested_.push_back(next_);
    next_ = next_.next();
  }
  return complete_.empty() ? now_s + kTick_s : std::min(ready_s_, now_s + kTick_s);
}

void WaitingViewer::leave() {
  link_.leave([] { return net::MasterLink::Values{}; });
}

}  // namespace telesplat::launcher
