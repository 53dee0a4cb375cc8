#include "services/data/volume/store.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <glm/matrix.hpp>
#include <list>

#include "common/core/utf8.h"
#include "common/geometry/number_text.h"
#include "services/data/volume/cast.h"
#include "services/data/volume/slices.h"

namespace telesplat::data {
namespace {

constexpr double kFastestDefault_hz = 12.5;
constexpr int kMaxParts = 1024;

struct Part {
  int index = 0, of = 1;
};

Result<Part> read_part(const std::string& text, int slices) {
  if (text.empty()) return Part{};
  std::string_view rest = text;
  const auto index = number_from<int>(take_until(rest, '/')), of = number_from<int>(rest);
  const int most = std::min(kMaxParts, slices);
  if (index && of && *of > most)
    return Error{fmt::format("part \"{}\": at most {} parts of {} slices", text.substr(0, 40), most, slices)};
  if (!index || !of || *index < 0 || *index >= *of)
    return Error{fmt::format("part \"{}\" is not I/N, with I from 0 to N - 1", text.substr(0, 40))};
  return Part{*index, *of};
}

// Places it as a mesh: the box centred, `up` turned to +y, the largest extent the room's size.
Result<glm::dmat4> place_volume(const Volume& v, const PlacementOptions& options) {
  const auto rotation = rotation_for_up(up_of_volume(options), v.space);
  if (!rotation) return rotation.error();
  const geometry::DBox box = v.box();
  const glm::dvec3 extent = box.size();
  const double largest = std::max({extent.x, extent.y, extent.z});
  if (!(largest >= 1e-30 && largest <= 1e30))
    return Error{fmt::format("its largest extent is {}, outside [1e-30, 1e30]", largest)};
  const double scale = options.room_size_m / largest;
  const glm::dvec3 centre = box.lo + extent * 0.5;
  glm::dmat4 out(1.0);
  for (int axis = 0; axis < 3; ++axis)
    out[axis] = glm::dvec4(*rotation * (glm::dvec3(v.index_to_data[axis]) * scale), 0);
  out[3] = glm::dvec4(*rotation * ((glm::dvec3(v.index_to_data[3]) - centre) * scale), 1);
  return out;
}

class Store final : public VolumeStore {
 public:
  using Step = std::shared_ptr<const VolumeSlices>;

  Store(StepReader read, size_t steps, std::string name, const VolumeOptions& options)
      : read_(std::move(read)), name_(std::move(name)), cache_bytes_(size_t(options.cache_mb) << 20) {
    session_.steps = int(steps);
    session_.lit = options.lit;
    session_.steps_per_s = steps < 2 ? 0 : options.steps_per_s.value_or(std::min(double(steps), kFastestDefault_hz));
  }

  Status initialise(const VolumeOptions& options, const PlacementOptions& placement, const Progress& progress) {
    auto first = read_(0, [&](double f) { progress(kReading, f / session_.steps); });
    if (!first) return first.error();
    const auto refuse = [&](const Error& e) { return Error{name_ + ": " + e.text}; };
    const auto index_to_room = place_volume(*first, placement);
    if (!index_to_room) return refuse(index_to_room.error());
    format_ = first->format, remark_ = first->remark;
    session_.grid = {first->size, *index_to_room};
    placement_ = {.data_to_room = *index_to_room * glm::inverse(first->index_to_data),
                  .box_data = first->box(),
                  .unit = first->unit};
    placement_.coordinates.space = first->space;
    if (const Status valid = volume::validate(session_.grid); !valid) return refuse(valid.error());
    const auto part = read_part(options.part, first->size[2]);
    if (!part) return refuse(part.error());
    session_.part = part->index, session_.parts = part->of;
    begin_ = slice_of(part->index), end_ = slice_of(part->index + 1);

    // Read all steps of a series that fits into memory: then levels cover all values.
    std::vector<Volume> all;
    all.push_back(std::move(*first));
    double lo = all[0].lo, hi = all[0].hi;
    if (double(all[0].stored.size()) * session_.steps <= double(cache_bytes_))
      for (int step = 1; step < session_.steps; ++step) {
        auto v = read_step(step, [&](double f) { progress(kReading, (step + f) / session_.steps); });
        if (!v) return v.error();
        lo = std::min(lo, v->lo), hi = std::max(hi, v->hi);
        all.push_back(std::move(*v));
      }
    const auto levels = choose_levels(all[0], lo, hi);
    if (!levels) return refuse(levels.error());
    session_.levels = *levels;
    const auto counts = count_levels(all[0], *levels);
    session_.array = to_utf8(all[0].array.substr(0, volume::kMaxArrayName - 4));
    session_.range = describe_values(counts, *levels, lo, hi, all[0].hounsfield);
    histogram_ = volume::histogram_of(counts, *levels);
    for (size_t step = 0; step < all.size(); ++step) {
      content_hash_ = XXH3_64bits_withSeed(all[step].stored.data(), all[step].stored.size(), content_hash_);
      keep(int(step), std::make_shared<VolumeSlices>(all[step], session_, begin_, end_));
      all[step].stored = {};
      progress(kSortingVoxels, double(step + 1) / double(all.size()));
    }
    const std::string transfer =
        options.transfer.empty() ? std::string(volume::fitting_preset(session_.range)) : options.transfer;
    auto resolved = volume::resolve_transfer(transfer, session_.range);
    if (!resolved) return resolved.error();
    session_.transfer = std::move(*resolved);
    // Fail here, not later in the processes that read this session.
    const auto again = volume::read_session(volume::to_parameters(session_), volume::to_facts(session_));
    if (!again) return refuse(again.error());
    return ok_status();
  }

  const volume::Session& session() const override { return session_; }
  const volume::Histogram& histogram() const override { return histogram_; }
  std::string format() const override { return format_; }
  std::string remark() const override { return remark_; }
  const scene::Placement& placement() const override { return placement_; }
  uint64_t content_hash() const override { return content_hash_; }

  Result<volume::Voxels> voxels(int step, int k_begin, int k_end, const volume::LevelSet& shown,
                                const volume::LevelSet& have) override {
    const auto slices = step_of(step);
    if (!slices) return slices.error();
    const int begin = std::clamp(k_begin, begin_, end_), end = std::clamp(k_end, begin, end_);
    volume::LevelSet wanted;
    for (int l = 0; l < session_.levels.count; ++l)
      if (shown.has(l) && !have.has(l)) wanted.add(l);
    return (*slices)->voxels(begin, end, wanted);
  }

  Result<scene::Probed> cast(int step, const volume::TransferFunction& transfer, const geometry::Clip& clip,
                             const scene::Probe& probe) override {
    const auto slices = step_of(step);
    if (!slices) return slices.error();
    const auto level_at = [&](int i, int j, int k) { return (*slices)->level(i, j, k); };
    auto found = data::cast(session_, {begin_, end_}, level_at, transfer, clip, probe);
    if (found && session_.range.hounsfield) found->array_unit = "HU";
    return found;
  }

  Result<std::vector<uint32_t>> slice_weights(int step, const volume::LevelSet& shown) override {
    const auto slices = step_of(step);
    if (!slices) return slices.error();
    return (*slices)->weights(shown);
  }

 private:
  int slice_of(int part) const { return int(int64_t{session_.grid.size[2]} * part / session_.parts); }

  // The reading thread calls it, too: it uses nothing that changes after initialise().
  Result<Volume> read_step(int step, const ReadProgress& progress) const {
    auto v = read_(size_t(step), progress);
    if (!v) return v.error();
    const auto& size = session_.grid.size;
    if (v->size != size)
      return Error{fmt::format("{}: step {} has {} x {} x {} voxels, the first one {} x {} x {}", name_, step,
                               v->size[0], v->size[1], v->size[2], size[0], size[1], size[2])};
    return v;
  }

  Result<Step> load(int step) const {
    const auto v = read_step(step, [](double) {});
    if (!v) return v.error();
    if (const auto levels = choose_levels(*v, v->lo, v->hi); !levels)
      return Error{fmt::format("{}: step {}: {}", name_, step, levels.error().text)};
    return Step(std::make_shared<VolumeSlices>(*v, session_, begin_, end_));
  }

  const Step* find(int step) {
    const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const auto& k) { return k.first == step; });
    if (found == kept_.end()) return nullptr;
    kept_.splice(kept_.begin(), kept_, found);
    return &kept_.front().second;
  }
  // Keeps a step. Drops the oldest beyond the limit, except the newest two: the shown step and the next one.
  void keep(int step, Step slices) {
    kept_.emplace_front(step, std::move(slices));
    size_t bytes = 0;
    for (const auto& k : kept_) bytes += k.second->bytes();
    for (; kept_.size() > 2 && bytes > cache_bytes_; kept_.pop_back()) bytes -= kept_.back().second->bytes();
  }

  Result<Step> step_of(int step) {
    if (step < 0 || step >= session_.steps)
      return Error{fmt::format("{}: step {}, there are {}", name_, step, session_.steps)};
    if (ahead_.valid() &&
        (ahead_step_ == step || ahead_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)) {
      auto loaded = ahead_.get();
      if (loaded)
        keep(ahead_step_, *loaded);
      else if (ahead_step_ == step)
        return loaded.error();
    }
    const Step* found = find(step);
    if (!found) {
      auto loaded = load(step);
      if (!loaded) return loaded.error();
      keep(step, *loaded);
      found = find(step);
    }
    const Step out = *found;
    const int next = (step + 1) % session_.steps;
    const bool held = std::any_of(kept_.begin(), kept_.end(), [&](const auto& k) { return k.first == next; });
    if (!held && !ahead_.valid()) {
      ahead_step_ = next;
      ahead_ = std::async(std::launch::async, [this, next] { return load(next); });
    }
    return out;
  }

  const StepReader read_;
  const std::string name_;
  const size_t cache_bytes_;
  volume::Session session_;
  volume::Histogram histogram_;
  scene::Placement placement_;
  std::string format_, remark_;
  uint64_t content_hash_ = 0;
  int begin_ = 0, end_ = 0;
  std::list<std::pair<int, Step>> kept_;  // the newest first
  int ahead_step_ = 0;
  std::future<Result<Step>> ahead_;  // last, because its destructor waits for the thread that uses the others
};

}  // namespace

std::string up_of_volume(const PlacementOptions& options) { return options.up == "auto" ? "z" : options.up; }

Result<std::unique_ptr<VolumeStore>> VolumeStore::open(const std::string& path, const VolumeOptions& options,
                                                       const PlacementOptions& placement, const Progress& progress) {
  const auto source = find_volume(path, options);
  if (!source) return source.error();
  const StepReader read = [source = *source](size_t step, const ReadProgress& told) {
    return read_volume(source, step, told);
  };
  return make(read, source->steps.size(), path, options, placement, progress);
}

Result<std::unique_ptr<VolumeStore>> VolumeStore::make(StepReader read, size_t steps, const std::string& name,
                                                       const VolumeOptions& options, const PlacementOptions& placement,
                                                       const Progress& progress) {
  if (steps < 1 || steps > size_t(volume::kMaxSteps))
    return Error{fmt::format("{}: {} steps, limits are 1..{}", name, steps, volume::kMaxSteps)};
  auto store = std::make_unique<Store>(std::move(read), steps, name, options);
  if (const Status done = store->initialise(options, placement, progress); !done) return done.error();
  return std::unique_ptr<VolumeStore>(std::move(store));
}

volume::LevelSet shown_levels(const volume::TransferFunction& transfer, const volume::Levels& levels) {
  volume::LevelSet out;
  const auto colours = volume::level_colours(transfer, levels);
  for (int l = 0; l < levels.count; ++l)
    if (colours[size_t(l)].extinction > 0) out.add(l);
  return out;
}

}  // namespace telesplat::data
