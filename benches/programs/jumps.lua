-- The same loop with goto.
local begin = os.clock()
local i, s = 0, 0
do
  local k
  ::top::
  i = i + 1
  k = i % 3
  if k == 1 then goto one end
  if k == 2 then goto two end
  s = s + 5
  goto back
  ::one::
  s = s + 1
  goto back
  ::two::
  s = s - 2
  ::back::
  if i < 1000000 then goto top end
end
print(os.clock() - begin, s)
