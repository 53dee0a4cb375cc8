#include "client/viewer/pictures/received_pictures.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "common/core/clock.h"
#include "common/image/jpeg.h"
#include "common/net/dispatch.h"

namespace telesplat::viewer {
namespace {

constexpr Feed kPictureFeeds[] = {{net::Kind::kDealer, "state"}};
constexpr double kIntroductionPeriod_s = 1;

constexpr uint32_t kColour = 0xffffff;

// Mixes a and b; share: weight of b in 1/256.
uint32_t mixed(uint32_t a, uint32_t b, uint32_t share) {
  const auto channel = [&](int shift) {
    return ((a >> shift & 255) * (256 - share) + (b >> shift & 255) * share + 128) >> 8 << shift;
  };
  return channel(16) | channel(8) | channel(0);
}

// Place of a pixel's centre between the centres of `from` pixels.
struct Place {
  int before, after;
  uint32_t share;
};
Place place_of(int at, int to, int from) {
  const double middle = std::clamp((at + 0.5) * from / to - 0.5, 0.0, double(from - 1));
  const int before = int(middle);
  return {before, std::min(before + 1, from - 1), uint32_t(std::lround((middle - before) * 256))};
}

}  // namespace

PictureGatherer::Open& PictureGatherer::open(const wire::Picture& tile) {
  const auto known = std::ranges::find_if(open_, [&](const Open& o) { return o.picture->frame == tile.frame; });
  if (known != open_.end()) return *known;
  if (open_.size() >= kMostOpen) open_.pop_front();
  auto picture = std::make_shared<ShownPicture>(ShownPicture{
      .epoch = tile.epoch, .frame = tile.frame, .request = tile.request, .camera = tile.camera, .view = {}});
  picture->view.width = tile.camera.width, picture->view.height = tile.camera.height;
  picture->view.colour.resize(size_t(tile.camera.width) * size_t(tile.camera.height));
  return open_.emplace_back(Open{std::move(picture), tile.tiles_in_frame, {}});
}

Result<std::shared_ptr<const ShownPicture>> PictureGatherer::add(const wire::Picture& tile) {
  if (const int64_t pixels = int64_t{tile.camera.width} * tile.camera.height; pixels > kMaxPixels)
    return Error{fmt::format("a picture of {} pixels, limit {}", pixels, kMaxPixels)};
  if (tile.request <= newest_) return std::shared_ptr<const ShownPicture>();
  Open& o = open(tile);
  if (o.picture->request != tile.request || o.picture->camera != tile.camera || o.tiles != tile.tiles_in_frame)
    return Error{fmt::format("a tile of another view than the others of frame {}", tile.frame.value)};
  image::View& view = o.picture->view;
  uint32_t* to = view.colour.data() + size_t(tile.rect.y) * size_t(view.width) + size_t(tile.rect.x);
  if (const Status s = image::decode_jpeg(tile.image, tile.rect.width, tile.rect.height, to, view.width); !s)
    return s.error();
  o.here.insert(tile.tile);
  if (o.here.size() < o.tiles) return std::shared_ptr<const ShownPicture>();
  std::shared_ptr<const ShownPicture> out = std::move(o.picture);
  newest_ = out->request;
  std::erase_if(open_, [&](const Open& other) { return !other.picture || other.picture->request <= newest_; });
  return out;
}

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

std::span<const Feed> ReceivedPictures::feeds() const { return kPictureFeeds; }

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

void scale_into(const image::View& from, image::View& to) {
  if (from.width == to.width && from.height == to.height) {
    std::ranges::transform(from.colour, to.colour.begin(), [](uint32_t c) { return c & kColour; });
    return;
  }
  std::vector<Place> columns(size_t(to.width));
  for (int x = 0; x < to.width; ++x) columns[size_t(x)] = place_of(x, to.width, from.width);
  for (int y = 0; y < to.height; ++y) {
    const Place row = place_of(y, to.height, from.height);
    const uint32_t* upper = &from.colour[size_t(row.before) * size_t(from.width)];
    const uint32_t* lower = &from.colour[size_t(row.after) * size_t(from.width)];
    for (int x = 0; x < to.width; ++x) {
      const Place& c = columns[size_t(x)];
      to.colour[size_t(y) * size_t(to.width) + size_t(x)] = mixed(
          mixed(upper[c.before], upper[c.after], c.share), mixed(lower[c.before], lower[c.after], c.share), row.share);
    }
  }
}

DrawnFrame PictureSource::draw(const FrameInput& input, image::View& view) {
  const DisplayedPicture shown = shelf_.displayed();
  DrawnFrame out;
  out.chosen_s = monotonic_s();
  out.empty = !shown.picture;
  if (out.empty) {
    if (input.even_empty) std::ranges::fill(view.colour, input.look.background);
    return out;
  }
  const ShownPicture& picture = *shown.picture;
  out.still = drawn_ == shown.picture;
  out.changed = !input.intact || !out.still;
  if (out.changed) scale_into(picture.view, view);
  drawn_ = shown.picture;
  // A picture has no depth: a comparison takes that of the data (kPictureOnly of the spool).
  if (input.with_depth) std::ranges::fill(view.depth_m, 1.0f);
  out.picture_of = picture.camera;
  out.selected = out.drawn = out.cached = picture.view.colour.size();
  out.items = 1;
  out.sequence = picture.frame.value;
  out.epoch = picture.epoch;
  out.update = shown.update;
  return out;
}

DrawnFrame PictureSource::draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>&,
                                    const std::array<splat::FrameTarget, 2>& targets) {
  image::View view{targets[0].width, targets[0].height, {}, {}};
  view.colour.resize(size_t(view.width) * size_t(view.height));
  FrameInput one = input;
  one.with_depth = one.intact = false;
  DrawnFrame out = draw(one, view);
  for (const auto& target : targets) std::ranges::copy(view.colour, target.colour);
  return out;
}

}  // namespace telesplat::viewer
