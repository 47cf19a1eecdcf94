"""REST for episodes of care."""

from uuid import UUID

from fastapi import APIRouter

from kata.clinic.episodes import service
from kata.clinic.episodes.schemas import Episode, EpisodeClose, EpisodeCreate, EpisodeList, EpisodeUpdate, StageCreate
from kata.dependencies import PROBLEMS, TheDatabase

router = APIRouter(tags=["episodes"])


@router.get("/api/patients/{patient_id}/episodes", responses=PROBLEMS.of(404, 422))
def list_episodes(database: TheDatabase, patient_id: UUID) -> EpisodeList:
    """A patient's episodes: those that go on first, then the newest first."""
    with database.read() as session:
        rows = service.of_patient(session, patient_id)
        return EpisodeList(items=[Episode.model_validate(row) for row in rows])


@router.post("/api/patients/{patient_id}/episodes", status_code=201, responses=PROBLEMS.of(404, 409, 422))
def open_episode(database: TheDatabase, patient_id: UUID, wanted: EpisodeCreate) -> Episode:
    """Begin the care of a shoulder. Each shoulder has one open episode at most."""
    with database.write() as session:
        return Episode.model_validate(service.open_new(session, patient_id, wanted))


@router.get("/api/episodes/{episode_id}", responses=PROBLEMS.of(404, 422))
def get_episode(database: TheDatabase, episode_id: UUID) -> Episode:
    """One episode with its stages."""
    with database.read() as session:
        return Episode.model_validate(service.get(session, episode_id))


@router.patch("/api/episodes/{episode_id}", responses=PROBLEMS.of(404, 409, 422))
def update_episode(database: TheDatabase, episode_id: UUID, change: EpisodeUpdate) -> Episode:
    """Change any part of it. A doctor's limits count from the next load on."""
    with database.write() as session:
        return Episode.model_validate(service.change(session, episode_id, change))


@router.post("/api/episodes/{episode_id}/close", responses=PROBLEMS.of(404, 409, 422))
def close_episode(database: TheDatabase, episode_id: UUID, given: EpisodeClose) -> Episode:
    """End the care of a shoulder: nothing is played to it until an episode is open again."""
    with database.write() as session:
        return Episode.model_validate(service.close(session, episode_id, given))


@router.post("/api/episodes/{episode_id}/reopen", responses=PROBLEMS.of(404, 409, 422))
def reopen_episode(database: TheDatabase, episode_id: UUID) -> Episode:
    """Go on with an episode that was closed."""
    with database.write() as session:
        return Episode.model_validate(service.reopen(session, episode_id))


@router.post("/api/episodes/{episode_id}/stages", status_code=201, responses=PROBLEMS.of(404, 409, 422))
def add_stage(database: TheDatabase, episode_id: UUID, given: StageCreate) -> Episode:
    """Note that from a day on the shoulder is in another stage."""
    with database.write() as session:
        return Episode.model_validate(service.add_stage(session, episode_id, given))


@router.delete("/api/episodes/{episode_id}/stages/{stage_id}", responses=PROBLEMS.of(404, 409, 422))
def remove_stage(database: TheDatabase, episode_id: UUID, stage_id: UUID) -> Episode:
    """Take back a stage that was noted by mistake."""
    with database.write() as session:
        return Episode.model_validate(service.remove_stage(session, episode_id, stage_id))
