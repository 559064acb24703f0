#include "bindings/records.hpp"

namespace sphshell {

template <class Value>
static const Value& shown(const Value& value) {
  return value;
}
template <class Row>
static auto shown(std::vector<Row>&& rows) {
  return to_array(std::move(rows));
}

// A dictionary of names and values, one after the other; vectors are moved into arrays.
template <class Value, class... Rest>
static void put(nb::dict& out, const char* name, Value&& value, Rest&&... rest) {
  out[name] = shown(std::forward<Value>(value));
  if constexpr (sizeof...(rest) > 0) put(out, std::forward<Rest>(rest)...);
}
template <class... Fields>
static nb::dict dict_of(Fields&&... fields) {
  nb::dict out;
  put(out, std::forward<Fields>(fields)...);
  return out;
}

// What numpy.dtype takes: names, formats, offsets and the size of a row.
nb::dict row_type(const RowField* fields, std::size_t count, std::size_t size) {
  nb::list names, formats, offsets;
  for (std::size_t i = 0; i < count; ++i) {
    const RowField& field = fields[i];
    names.append(field.name);
    formats.append(field.size == 1 ? nb::object(nb::str(field.type))
                                   : nb::make_tuple(field.type, field.size));
    offsets.append(field.offset);
  }
  return dict_of("names", names, "formats", formats, "offsets", offsets, "itemsize", size);
}

// Rows of times and states (n, ...); contacts of all rows one behind the other, with the row of
// each; events and sensor readings column by column.
nb::dict to_dict(Record record, int nq, int nv) {
  const std::size_t n = record.t.size();
  SensorRows& sensors = record.sensors;
  nb::dict out = dict_of(
      "t", std::move(record.t), "q", to_array(std::move(record.q), {n, std::size_t(nq)}), "v",
      to_array(std::move(record.v), {n, std::size_t(nv)}), "energy",
      rows_of<Record::kEnergies>(std::move(record.energy)), "contact_row",
      std::move(record.contact_row), "contacts", to_bytes(std::move(record.contacts)), "event_t",
      column(record.events, &Event::t), "event_pair", column(record.events, &Event::pair),
      "event_kind", column(record.events, [](const Event& one) { return int(one.kind); }), "sensor",
      std::move(sensors.sensor), "sensor_t", std::move(sensors.t), "sensor_sampled",
      std::move(sensors.sampled), "sensor_values", std::move(sensors.values));
  if (record.states)
    put(out, "states", std::move(*record.states), "state_sizes", std::move(record.state_sizes));
  if (record.torques) out["torques"] = to_array(std::move(*record.torques), {n, std::size_t(nv)});
  if (record.patches) out["patches"] = to_bytes(std::move(*record.patches));
  return out;
}

nb::dict as_python(SensitivityRecord record) {
  return dict_of("q", std::move(record.q), "v", std::move(record.v), "force_world",
                 std::move(record.force_world), "normal_force", std::move(record.normal_force),
                 "depth", std::move(record.depth));
}

nb::dict as_python(const Counts& counts) {
  return dict_of("steps", counts.steps, "rejected", counts.rejected, "evaluations",
                 counts.evaluations, "event_steps", counts.event_steps, "event_queries",
                 counts.event_queries);
}

nb::object as_python(const std::optional<DeepStart>& start) {
  if (!start) return nb::none();
  return nb::make_tuple(start->pair, start->depth);
}

nb::list as_python(const std::vector<PairSummary>& summaries) {
  nb::list out;
  for (const PairSummary& s : summaries)
    out.append(dict_of("contact_time", s.contact_time, "impulse", s.impulse, "peak_force",
                       s.peak_force, "peak_force_time", s.peak_force_time, "max_depth", s.max_depth,
                       "max_depth_time", s.max_depth_time, "touches", s.touches));
  return out;
}

nb::list as_python(const std::vector<LimitSummary>& limits) {
  nb::list out;
  for (const LimitSummary& s : limits)
    out.append(dict_of("cut_time", s.cut_time, "first_cut", s.first_cut, "peak_speed", s.peak_speed,
                       "first_too_fast", s.first_too_fast));
  return out;
}

}  // namespace sphshell
