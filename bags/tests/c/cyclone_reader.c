/* A CycloneDDS reader with the QoS of rmw_cyclonedds, reliable and of depth 10: `cyclone_reader DOMAIN COUNT`.
 *
 * Takes each sample where CycloneDDS receives it, so that none is overwritten before a thread of its own has woken up:
 * what is missing has not come. Ends when it has COUNT samples, or when nothing more has come for three seconds. Prints
 * one JSON object: samples taken, those that the writer could not send again, and the time from the first to the last.
 *
 * cc -O2 cyclone_reader.c String.c -lddsc, String.c and String.h made by `idlc String.idl`.
 */
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>

#include "String.h"
#include "dds/dds.h"

#define DEPTH 10
#define QUIET DDS_SECS(3)

static atomic_ulong taken;
static _Atomic dds_time_t first, last;

static void need(dds_return_t code, const char *what) {
  if (code < 0) {
    fprintf(stderr, "%s: %s\n", what, dds_strretcode(-code));
    exit(1);
  }
}

static void take(dds_entity_t reader, void *unused) {
  (void)unused;
  void *samples[DEPTH] = {NULL};
  dds_sample_info_t infos[DEPTH];
  dds_return_t got = dds_take(reader, samples, infos, DEPTH, DEPTH);
  need(got, "take");
  for (int i = 0; i < got; i++) taken += infos[i].valid_data;
  if (got > 0) {
    last = dds_time();
    if (first == 0) first = last;
    dds_return_loan(reader, samples, got);
  }
}

static dds_entity_t reader_in(dds_domainid_t domain) {
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, DEPTH);
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_listener_t *listener = dds_create_listener(NULL);
  dds_lset_data_available(listener, take);
  dds_entity_t participant = dds_create_participant(domain, NULL, NULL);
  need(participant, "participant");
  dds_entity_t topic = dds_create_topic(participant, &std_msgs_msg_dds__String__desc, "rt/bench", NULL, NULL);
  need(topic, "topic");
  dds_entity_t reader = dds_create_reader(participant, topic, qos, listener);
  need(reader, "reader");
  dds_delete_listener(listener);
  dds_delete_qos(qos);
  return reader;
}

int main(int argc, char **argv) {
  if (argc != 3) {
    fprintf(stderr, "usage: cyclone_reader DOMAIN COUNT\n");
    return 2;
  }
  const unsigned long count = strtoul(argv[2], NULL, 10);
  dds_entity_t reader = reader_in((dds_domainid_t)strtoul(argv[1], NULL, 10));
  while (taken < count && (first == 0 || dds_time() - last < QUIET)) dds_sleepfor(DDS_MSECS(10));
  dds_sample_lost_status_t lost;
  need(dds_get_sample_lost_status(reader, &lost), "lost");
  printf("{\"taken\": %lu, \"unsent\": %u, \"seconds\": %.3f}\n", taken, lost.total_count, (double)(last - first) / 1e9);
  return 0;
}
