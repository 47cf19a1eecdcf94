/** What is told on every page of the database and of what is kept without it. */
export const KEPT = {
  away: (since: string) =>
    `The database does not answer since ${since}. Nothing is lost: what happens at the apparatus is kept on this computer and written there when it is back. What has begun goes on, and Stop works; signing in, records and beginning something have to wait.`,
  diskFull: (since: string) =>
    `This computer's disk takes nothing since ${since}: what happens at the apparatus is not kept. End what is going on, make room on the disk, and tell whoever looks after this computer.`,
} as const;
