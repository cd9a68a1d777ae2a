-- Schema 2: the history and the attempts of a request are found without looking at all of them.
CREATE INDEX changes_of_request ON changes (request, sequence);
CREATE INDEX attempts_of_request ON attempts (request, task);
