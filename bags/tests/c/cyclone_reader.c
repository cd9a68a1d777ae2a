/* A CycloneDDS reader as rmw_cyclonedds has it by default, reliable and of depth 10: `cyclone_reader DOMAIN COUNT`.
 *
 * Takes what comes until it has COUNT samples, or nothing more has come for three seconds. Prints one JSON object:
 * samples taken, samples that the writer could not send again, and how long it took from the first to the last one.
 *
 * cc -O2 cyclone_reader.c String.c -lddsc, String.c and String.h made by `idlc String.idl`.
 */
#include <stdio.h>
#include <stdlib.h>

#include "String.h"
#include "dds/dds.h"

#define DEPTH 10
#define QUIET DDS_SECS(3)

static void need(dds_return_t code, const char *what) {
  if (code < 0) {
    fprintf(stderr, "%s: %s\n", what, dds_strretcode(-code));
    exit(1);
  }
}

static dds_entity_t reader_in(dds_domainid_t domain) {
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, DEPTH);
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_entity_t participant = dds_create_participant(domain, NULL, NULL);
  need(participant, "participant");
  dds_entity_t topic =
      dds_create_topic(participant, &std_msgs_msg_dds__String__desc, "rt/bench", NULL, NULL);
  need(topic, "topic");
  dds_entity_t reader = dds_create_reader(participant, topic, qos, NULL);
  need(reader, "reader");
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
  dds_entity_t waitset = dds_create_waitset(DDS_CYCLONEDDS_HANDLE);
  need(waitset, "waitset");
  need(dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS), "status");
  need(dds_waitset_attach(waitset, reader, reader), "attach");

  unsigned long taken = 0;
  dds_time_t first = 0, last = 0;
  void *samples[DEPTH] = {NULL};
  dds_sample_info_t infos[DEPTH];
  while (taken < count && (taken == 0 || dds_time() - last < QUIET)) {
    dds_attach_t ready;
    dds_waitset_wait(waitset, &ready, 1, DDS_MSECS(100));
    dds_return_t got;
    while ((got = dds_take(reader, samples, infos, DEPTH, DEPTH)) > 0) {
      last = dds_time();
      if (taken == 0) first = last;
      for (int i = 0; i < got; i++) taken += infos[i].valid_data;
      dds_return_loan(reader, samples, got);
    }
    need(got, "take");
  }
  dds_sample_lost_status_t lost;
  need(dds_get_sample_lost_status(reader, &lost), "lost");
  printf("{\"taken\": %lu, \"unsent\": %u, \"seconds\": %.3f}\n", taken, lost.total_count, (double)(last - first) / 1e9);
  return 0;
}
