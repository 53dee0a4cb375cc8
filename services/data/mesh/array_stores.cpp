#include "services/data/mesh/array_stores.h"

#include <chrono>
#include <exception>
#include <utility>

namespace telesplat::data {
namespace {

struct GivenUp {};

}  // namespace

ArrayStores::ArrayStores(std::shared_ptr<const MeshStore> first, const std::string& array, Open open)
    : first_(array), open_array_(std::move(open)) {
  open_[array] = std::move(first);
}

ArrayStores::~ArrayStores() {
  stop_ = true;
  if (opening_.valid()) opening_.wait();
}

const MeshStore* ArrayStores::find(const std::string& array) const {
  const auto found = open_.find(array);
  return found == open_.end() ? nullptr : found->second.get();
}

void ArrayStores::begin(const std::string& array) {
  opening_array_ = array;
  opening_ = std::async(std::launch::async, [this, array]() -> Made {
    try {
      return open_array_(array, [this](const char*, double) {
        if (stop_) throw GivenUp();
      });
    } catch (const GivenUp&) {
      return Error{"given up: the data server ends"};
    } catch (const std::exception& e) {
      return Error{e.what()};
    }
  });
}

void ArrayStores::want(const std::string& array) {
  if (find(array)) return;
  if (!opening_.valid())
    begin(array);
  else if (opening_array_ != array)
    next_ = array;
  else
    next_.reset();
}

std::optional<ArrayStores::Opened> ArrayStores::take_opened() {
  if (!opening_.valid() || opening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
  Made made = opening_.get();
  Opened out{opening_array_, made ? ok_status() : Status(made.error())};
  if (made) {
    for (auto old = open_.begin(); open_.size() >= kKept && old != open_.end();)
      old = old->first == first_ ? std::next(old) : open_.erase(old);
    open_[opening_array_] = *std::move(made);
  }
  if (next_) begin(*std::exchange(next_, std::nullopt));
  return out;
}

}  // namespace telesplat::data
