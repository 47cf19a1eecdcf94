"""REST routes of episodes of care."""

from uuid import UUID

from fastapi import APIRouter

from kata.clinic.episodes import service
from kata.clinic.episodes.schemas import Episode, EpisodeClose, EpisodeCreate, EpisodeUpdate, StageCreate
from kata.clinic.sessions.router import TheOfflineCache
from kata.dependencies import PROBLEMS, TheDatabase
from kata.pagination import Page

router = APIRouter(tags=["episodes"])


@router.get(
    "/api/patients/{patient_id}/episodes", summary="List a patient's episodes of care", responses=PROBLEMS.of(404, 422)
)
def list_episodes(database: TheDatabase, patient_id: UUID) -> Page[Episode]:
    """Return a patient's episodes, open ones first, then newest first. A patient has few, so the list has no pages."""
    with database.read() as session:
        rows = service.of_patient(session, patient_id)
        return Page[Episode].complete([Episode.model_validate(row) for row in rows])


@router.post(
    "/api/patients/{patient_id}/episodes",
    summary="Open an episode of care",
    status_code=201,
    responses=PROBLEMS.of(404, 409, 422),
)
def open_episode(database: TheDatabase, patient_id: UUID, body: EpisodeCreate) -> Episode:
    """Open an episode of care for a shoulder. Each shoulder has at most one open episode."""
    with database.write() as session:
        return Episode.model_validate(service.open_new(session, patient_id, body))


@router.get("/api/episodes/{episode_id}", summary="Get an episode of care", responses=PROBLEMS.of(404, 422))
def get_episode(database: TheDatabase, episode_id: UUID) -> Episode:
    """Return one episode with its stages."""
    with database.read() as session:
        return Episode.model_validate(service.get(session, episode_id))


@router.patch("/api/episodes/{episode_id}", summary="Change an episode of care", responses=PROBLEMS.of(404, 409, 422))
def update_episode(
    database: TheDatabase, offline_cache: TheOfflineCache, episode_id: UUID, change: EpisodeUpdate
) -> Episode:
    """Change an episode. A doctor's limits take effect at the next load. A recording that was loaded before is not played any more."""
    with database.write() as session:
        changed = Episode.model_validate(service.change(session, episode_id, change))
    offline_cache.refresh_soon()
    return changed


@router.post(
    "/api/episodes/{episode_id}/close", summary="Close an episode of care", responses=PROBLEMS.of(404, 409, 422)
)
def close_episode(database: TheDatabase, episode_id: UUID, body: EpisodeClose) -> Episode:
    """Close an episode of care. The apparatus plays no motion to this shoulder until an episode is open again."""
    with database.write() as session:
        return Episode.model_validate(service.close(session, episode_id, body))


@router.post(
    "/api/episodes/{episode_id}/reopen", summary="Reopen an episode of care", responses=PROBLEMS.of(404, 409, 422)
)
def reopen_episode(database: TheDatabase, episode_id: UUID) -> Episode:
    """Reopen a closed episode."""
    with database.write() as session:
        return Episode.model_validate(service.reopen(session, episode_id))


@router.post(
    "/api/episodes/{episode_id}/stages", summary="Add a stage", status_code=201, responses=PROBLEMS.of(404, 409, 422)
)
def add_stage(database: TheDatabase, episode_id: UUID, body: StageCreate) -> Episode:
    """Record the stage of the shoulder from a given day on."""
    with database.write() as session:
        return Episode.model_validate(service.add_stage(session, episode_id, body))


@router.delete(
    "/api/episodes/{episode_id}/stages/{stage_id}", summary="Remove a stage", responses=PROBLEMS.of(404, 409, 422)
)
def remove_stage(database: TheDatabase, episode_id: UUID, stage_id: UUID) -> Episode:
    """Remove a stage that was recorded by mistake."""
    with database.write() as session:
        return Episode.model_validate(service.remove_stage(session, episode_id, stage_id))
