//! What the page says around its tables. The conclusions are read again whenever the tables change.

pub(super) const CONCLUSIONS: &str = "\
# What many GPUs would do with renders in parts

`cargo experiments farm` writes this page. It measures nothing: it simulates farms of up to 10,000 GPUs, from numbers that were
measured on one or two and from others that are assumed ([both are listed](#what-goes-in)). A job is pictures in parts of
some minutes ([parts.md](parts.md)). A task renders a part on one GPU and writes a film; a merge for each picture adds its films.

*Times* are the time until the last picture is written, over the time in which the same GPUs would take the samples and do
nothing else. 1 is ideal.

## What follows

- **Minutes of a task.** Five are good for up to 1,000 GPUs, and ten from there on. For other jobs, take the square root of twice
  the seconds in which a GPU of a task does not render (start, and writing the film: 5 to 11 s) times the seconds of the whole
  job. Nothing is gained by less than GPUs divided by the tasks that the scheduler starts a second: 10,000 GPUs and 20 tasks a
  second make 8 minutes.
- **Checkpoints.** `impasto farm new` keeps one every 30 s, and a GPU stands still while its film is gathered and written. That is
  nothing for HD. With 4K and five outputs it is up to 5 s each time, and 1,000 GPUs write 35 GB/s. With `--checkpoint-every 300`
  times go from 1.27 to 1.11 on 10 GPUs and from 2.23 to 1.26 on 1,000. A GPU whose node fails then loses 2.5 minutes in
  place of a quarter of one.
- **Slurm's queue.** It takes 10,000 tasks by default (`MaxJobCount`). An hour of 1,000 GPUs is 12,000 tasks of five minutes: take
  ten, or have it raised.
- **Merges of many pictures.** Merge all films of each at once, and on all nodes: with one merge at a time, a job of 300 pictures
  takes three times as long. Arrays of a part of all pictures, as `impasto farm submit` makes them, leave all merges until the
  end, and films of 4K then wait for the file system: 1.26. Picture after picture it is 1.11; a tree of 32 films a merge makes it
  1.16, since its first merges run beside renders.
- **Merges of one picture** take 0.93 s a film of 4K with outputs, and 0.05 s a film of HD. So a tree pays from some tens of large
  films on: 1,000 of them take 933 s at once, and 81 s in merges of 32 (`impasto merge --out F.film` makes the inner films).
- **Failures.** At rates that clusters report, a node of 1,000 GPUs fails every 30 hours, which loses minutes of a GPU. Checkpoints
  matter for tasks of 40 minutes on machines that fail daily, such as those that are lent until somebody pays more. Tasks of five
  minutes need none.

What breaks first, with tasks of five minutes and checkpoints every 30 s:

| GPUs | HD | 4K with five outputs |
|---|---|---|
| 10 | nothing: 1.07, of which unequal speeds are most | checkpoints, for which GPUs wait: 1.27 |
| 100 | nothing: 1.07 | checkpoints: 1.29 |
| 1,000 | Slurm's queue | the queue; then the file system of 20 GB/s, full of checkpoints: 2.23 |
| 10,000 | the queue; then the scheduler, at 20 tasks a second: 1.79 | the queue; then the file system of 100 GB/s: 4.46, and 1.89 without so many checkpoints; then the scheduler |

Four things of the program cost time here. The default of checkpoints does not ask how large a film is. A task writes its last
checkpoint and then the same samples again as its film, which is one of the three films that a short task moves. GPUs wait while
films are gathered and written. Merges wait until all parts of all pictures are rendered.
";

pub(super) const MINUTES: &str = "\
## Minutes of a task

Times of jobs that take every GPU an hour, in pictures of 200 minutes of a GPU. Bold are those within 1 % of the best. The last
column is the rule above, or the minutes from which the file system takes all films and checkpoints, whichever is more; *none* is
where checkpoints alone are too much for it. Where the scheduler or the file system decide, twice the rule is better.

| film | checkpoints, s | GPUs | 1 min | 2 min | 5 min | 10 min | 20 min | 40 min | rule, min |
|---|---|---|---|---|---|---|---|---|---|
";

pub(super) const LIMITS: &str = "\
## What breaks first

Times with tasks of five minutes, and without one limit at a time. The last column is the one without which it is fastest.
Without the scheduler's limit all GPUs begin, and so write their films, at the same moment: that may be slower.

| film | checkpoints, s | GPUs | with all | without start | gathering | checkpoints | file system | scheduler | unequal speeds | first |
|---|---|---|---|---|---|---|---|---|---|---|
";

pub(super) const TRAFFIC: &str = "\
## Films, files and the queue

Films that a task moves: checkpoints on the way, the last one, its film, and that film again when it is merged. The next columns
are megabytes a second of a GPU, and how many GPUs fill 10 GB/s. The others are of an hour of 1,000 GPUs: tasks (bold if they are
more than Slurm's queue takes by default), arrays, files (film, record and two logs of a part; two pictures, record and two logs of a
merge), and terabytes of films until someone removes them. Arrays of at most 1,000 tasks are no limit: `impasto farm submit`
needs few of them.

| film | minutes | checkpoints, s | films | MB/s | GPUs at 10 GB/s | tasks | arrays | files | TB |
|---|---|---|---|---|---|---|---|---|---|
";

pub(super) const MERGES: &str = "\
## Merging

Seconds from the last part to the picture, for one picture of 4K with outputs and 1,000 GPUs, of which each renders one part at most.
The last columns are times of 300 pictures of 40 films each: as they are submitted, with all parts of a picture before those of the
next (in turn), and with one merge at a time on the whole farm. Checkpoints are 300 s apart.

| films of a merge | 8 films | 32 films | 128 films | 512 films | 1000 films | 300 pictures | in turn | one merge at a time |
|---|---|---|---|---|---|---|---|---|
";

pub(super) const FAILURES: &str = "\
## Failures

Eight hours of 1,000 GPUs, HD. A node that fails takes 8 tasks along, is noticed after 300 s and is back after an hour, so that a
part of the times is GPUs that are away. The cells are GPU hours (of 8,000) that were rendered again, and times.

| hours between failures of a node | failures | 5 min, checkpoints 30 s | 5 min, none | 40 min, checkpoints 30 s | 40 min, none |
|---|---|---|---|---|---|
";

pub(super) const INPUTS: &str = "\
## What goes in

Measured:

- Planes of films ([parts.md](parts.md), \"The file\"): bytes of `impasto render examples/cornell/scene.toml --device cpu --size 64x64
  --spp 16 --out F.film`, without outputs and with `--aov albedo,normal,position,depth,material`, by 4 x 64 x 64.
- Gathering a film on the processor: 3.8 s for 55 planes of 4K ([measurements.md](measurements.md), \"Several GPUs of one host\"). That
  includes the picture, and so is too much for a part.
- A stream of a film, read or written: 1.14 GB/s, as fast as films in memory merge ([measurements.md](measurements.md), \"Merging
  films\", has the command).

| film | size | planes, of all | file | gathering |
|---|---|---|---|---|
";

pub(super) const ASSUMED: &str = "
Assumed:

| what | value | why |
|---|---|---|
| start of a task | 5 s | pipelines are built in 0.2 to 0.6 s (measurements.md); the rest is Slurm, scene and trees |
| start of a merge | 1 s | |
| file system | 1.2, 5, 20 and 100 GB/s for 10, 100, 1,000 and 10,000 GPUs | the first is a server at 10 Gbit/s |
| tasks started a second | 20 | Slurm was validated at 500 simple ones (its High Throughput Computing guide) after tuning |
| an array, the queue, a lost node | 1,001 elements, 10,000 tasks, noticed after 300 s | defaults of slurm.conf: MaxArraySize, MaxJobCount, SlurmdTimeout |
| failures | 6.5 in 1,000 days of a node, that is one in 3,692 h | Kokolis et al. 2025, \"Revisiting Reliability in Large-Scale Machine Learning Research Clusters\", RSC-1 |
| repair | 1 h | |
| GPUs of a node; merges at a time | 8; one a node | |
| speeds of GPUs, costs of pictures | even within 10 % of the mean | |
| the seed | 1 | by four others, times of five minutes differ by less than 0.03 with 10 GPUs, 0.02 with 100 and 0.01 with more |

Arrays are submitted as `impasto farm` does: a part of all pictures after another, or, with more parts than pictures, all parts
of a picture. A lost part goes on from its last checkpoint, before all that wait.

Left out: metadata of the file system and its servers' caches, the network within a node, failures of merges, of the file system and
of the scheduler, other users, pictures that take several times as long as others, and several GPUs in a task. The file system
shares its bandwidth evenly, which no real one does when it is full.

The unit tests of `experiments/src/farm/sim.rs` hold the simulation to closed forms: rounds of tasks, a writer and many bound
by bandwidth, a scheduler, levels of a tree, and the expected number and loss of failures.
";
