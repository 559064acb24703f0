#include "bindings/records.hpp"

namespace sphshell {

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
  nb::dict out;
  out["names"] = names;
  out["formats"] = formats;
  out["offsets"] = offsets;
  out["itemsize"] = size;
  return out;
}

// Rows of times and states (n, ...); contacts of all rows one behind the other, with the row of
// each; events and sensor readings column by column.
nb::dict to_dict(Record record, int nq, int nv) {
  nb::dict out;
  const std::size_t n = record.t.size();
  std::vector<double> event_t;
  std::vector<int> event_pair, event_kind;
  for (const Event& e : record.events) {
    event_t.push_back(e.t);
    event_pair.push_back(e.pair);
    event_kind.push_back(static_cast<int>(e.kind));
  }
  out["t"] = to_array(std::move(record.t));
  out["q"] = to_array(std::move(record.q), {n, std::size_t(nq)});
  out["v"] = to_array(std::move(record.v), {n, std::size_t(nv)});
  out["energy"] = to_array(std::move(record.energy), {n, std::size_t(Record::kEnergies)});
  out["contact_row"] = to_array(std::move(record.contact_row));
  out["contacts"] = to_bytes(std::move(record.contacts));
  if (record.states) {
    out["states"] = to_array(std::move(*record.states));
    out["state_sizes"] = to_array(std::move(record.state_sizes));
  }
  if (record.torques) out["torques"] = to_array(std::move(*record.torques), {n, std::size_t(nv)});
  if (record.patches) out["patches"] = to_bytes(std::move(*record.patches));
  out["event_t"] = to_array(std::move(event_t));
  out["event_pair"] = to_array(std::move(event_pair));
  out["event_kind"] = to_array(std::move(event_kind));
  out["sensor"] = to_array(std::move(record.sensors.sensor));
  out["sensor_t"] = to_array(std::move(record.sensors.t));
  out["sensor_sampled"] = to_array(std::move(record.sensors.sampled));
  out["sensor_values"] = to_array(std::move(record.sensors.values));
  return out;
}

nb::dict as_python(SensitivityRecord record) {
  nb::dict out;
  out["q"] = to_array(std::move(record.q));
  out["v"] = to_array(std::move(record.v));
  out["force_world"] = to_array(std::move(record.force_world));
  out["normal_force"] = to_array(std::move(record.normal_force));
  out["depth"] = to_array(std::move(record.depth));
  return out;
}

nb::dict as_python(const Counts& counts) {
  nb::dict out;
  out["steps"] = counts.steps;
  out["rejected"] = counts.rejected;
  out["evaluations"] = counts.evaluations;
  out["event_steps"] = counts.event_steps;
  out["event_queries"] = counts.event_queries;
  return out;
}

nb::object as_python(const std::optional<DeepStart>& start) {
  if (!start) return nb::none();
  return nb::make_tuple(start->pair, start->depth);
}

nb::list as_python(const std::vector<PairSummary>& summaries) {
  nb::list out;
  for (const PairSummary& s : summaries) {
    nb::dict d;
    d["contact_time"] = s.contact_time;
    d["impulse"] = s.impulse;
    d["peak_force"] = s.peak_force;
    d["peak_force_time"] = s.peak_force_time;
    d["max_depth"] = s.max_depth;
    d["max_depth_time"] = s.max_depth_time;
    d["touches"] = s.touches;
    out.append(d);
  }
  return out;
}

nb::list as_python(const std::vector<LimitSummary>& limits) {
  nb::list out;
  for (const LimitSummary& s : limits) {
    nb::dict d;
    d["cut_time"] = s.cut_time;
    d["first_cut"] = s.first_cut;
    d["peak_speed"] = s.peak_speed;
    d["first_too_fast"] = s.first_too_fast;
    out.append(d);
  }
  return out;
}

}  // namespace sphshell
