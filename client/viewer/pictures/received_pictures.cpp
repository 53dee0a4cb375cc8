#include "client/viewer/pictures/received_pictures.h"

#include "client/viewer/pictures/source.h"
#include "common/core/clock.h"
#include "common/net/dispatch.h"

namespace telesplat::viewer {
namespace {

constexpr Feed kFeeds[] = {{net::Kind::kDealer, "state"}};
constexpr double kIntroductionPeriod_s = 1;

}  // namespace

void PictureShelf::put(DisplayedPicture picture) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(picture));
  if (waiting_.size() > wire::kMaxBuffers) waiting_.pop_front();
}

void PictureShelf::advance(RequestId request) {
  std::deque<DisplayedPicture> passed;  // freed after the lock is released
  const std::lock_guard lock(mutex_);
  while (!waiting_.empty() && waiting_.front().update.request <= request) {
    passed.push_back(std::exchange(displayed_, std::move(waiting_.front())));
    waiting_.pop_front();
  }
}

DisplayedPicture PictureShelf::displayed() const {
  const std::lock_guard lock(mutex_);
  return displayed_;
}

Status ReceivedPictures::follow(const wire::Welcome&) { return ok_status(); }

std::span<const Feed> ReceivedPictures::feeds() const { return kFeeds; }

void ReceivedPictures::receive(int most) {
  net::Socket& state = *links_.feeds.find("state");
  for (int n = 0; n < most; ++n) {
    const auto message = state.receive();
    if (!message) return;
    net::dispatch<wire::Picture>(state, *message, [&](const wire::Picture& m) { on(m, message->arrived_s); });
  }
}

void ReceivedPictures::on(const wire::Picture& m, double arrived_s) {
  if (m.viewer != links_.viewer) return;
  const double begin_s = monotonic_s();
  auto complete = gatherer_.add(m);
  if (!complete) {
    ++decode_errors_;
    if (log_limit_.allow(begin_s))
      log::warn("tile {} of picture {}: {}: dropped", m.tile, m.frame.value, complete.error().text);
    return;
  }
  const double decoded_s = monotonic_s();
  links_.spans.add("decode", links_.to_master_s(begin_s), links_.to_master_s(decoded_s), 1,
                   {.frame = double(m.frame.value), .request = double(m.request.value)});
  if (*complete) complete_[m.request] = *complete;
  const uint64_t pixels = uint64_t(m.rect.width) * uint64_t(m.rect.height);
  links_.on_part({.viewer = m.viewer,
                  .request = m.request,
                  .epoch = m.epoch,
                  .frame = m.frame,
                  .complete = *complete != nullptr,
                  .points = pixels,
                  .samples = pixels,
                  .bytes = m.image.size(),
                  .camera = m.camera,
                  .tile = m.tile,
                  .moments = m.moments,
                  .arrived_s = links_.to_master_s(arrived_s),
                  .decode_begin_s = links_.to_master_s(begin_s),
                  .decoded_s = links_.to_master_s(decoded_s)});
}

void ReceivedPictures::on_update(const ShownUpdate& update) {
  const auto found = complete_.find(update.request);
  if (found == complete_.end()) return;
  shelf_.put({found->second, update});
  complete_.erase(complete_.begin(), std::next(found));
}

void ReceivedPictures::tick(double now_s) {
  if (now_s - introduced_s_ < kIntroductionPeriod_s) return;
  introduced_s_ = now_s;
  links_.feeds.find("state")->send(wire::SliceAck{links_.viewer, {}, 1, false});
}

void ReceivedPictures::add_status(net::MasterLink::Values& values) const {
  const auto shown = shelf_.displayed();
  values["pixels"] = shown.picture ? double(shown.picture->view.colour.size()) : 0.0;
  values["messages_rejected"] += double(decode_errors_);
}

Result<std::unique_ptr<ViewSource>> ReceivedPictures::make_source(const DisplayOptions&, Renderers&) {
  return std::unique_ptr<ViewSource>(new PictureSource(shelf_));
}

}  // namespace telesplat::viewer
