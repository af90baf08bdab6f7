// How far the queries of a place are.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_QUERY_STATE_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_QUERY_STATE_GLSL

// Stand in walk_resume for a query that its quota stopped, and for a place that has none or is done. In scenes with media a place has two: the beam through
// the media on the way there comes first.
const uint GATHER_STOPPED = 0xFFFFFFFEu;
const uint GATHER_DONE = 0xFFFFFFFCu;
const uint BEAM_DONE = 0xFFFFFFFBu;
const uint BEAM_STOPPED = 0xFFFFFFFAu;
const uint BEAM_STOPPED_GATHER_DONE = 0xFFFFFFF9u;
const uint BEAM_STOPPED_GATHER_STOPPED = 0xFFFFFFF8u;
// The walk through a grid that comes before a beam goes on in a later dispatch.
const uint BEAM_WALKING = 0xFFFFFFF7u;
// The beam is done but for the ray that tells whether the planes it has met are seen.
const uint BEAM_TRACING = 0xFFFFFFF6u;
// The way of the beam is known, and its query waits in a queue.
const uint BEAM_ASKS = 0xFFFFFFF5u;

// Whether all light of the beam is there, or will be once it goes through all records: nothing else is added before.
bool beam_is_known(uint resume) { return resume == BEAM_DONE || resume == BEAM_STOPPED; }
bool beam_has_stopped(uint resume) {
    return resume == BEAM_STOPPED || resume == BEAM_STOPPED_GATHER_DONE || resume == BEAM_STOPPED_GATHER_STOPPED;
}
bool gather_has_stopped(uint resume) { return resume == GATHER_STOPPED || resume == BEAM_STOPPED_GATHER_STOPPED; }
// Whether the beam of a place has been asked for, whatever has become of it; and whether its way is known, or nothing on it asks.
bool beam_was_asked(uint resume) {
    return beam_is_known(resume) || beam_has_stopped(resume) || resume == GATHER_DONE || resume == GATHER_STOPPED || resume == BEAM_TRACING;
}
bool beam_was_begun(uint resume) { return beam_was_asked(resume) || resume == BEAM_ASKS; }

// What stands there for a point's query that is done, or stopped, by what stood there for the beam.
uint gather_done(uint resume) { return resume == BEAM_STOPPED ? BEAM_STOPPED_GATHER_DONE : GATHER_DONE; }
uint gather_stopped(uint resume) {
    return resume == BEAM_STOPPED || resume == BEAM_STOPPED_GATHER_DONE ? BEAM_STOPPED_GATHER_STOPPED : GATHER_STOPPED;
}

#endif
